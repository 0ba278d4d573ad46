"""The names that an answer carries: of the database, the run and the question that it is meant for.

Another database has a question of the same number, and a copy has one of the same public id. So whatever an
answer names is compared, in the answer's own transaction, and an answer that is meant for elsewhere is not
stored.
"""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import Row, and_, bindparam, select
from sqlalchemy.orm import Session

from parenting.drawing.sentences import mark
from parenting.server.errors import DamagedRowError, ElsewhereError, NotFound
from parenting.server.identity import UNREADABLE, stated
from parenting.server.tables import Identity, Query, Run, Table


@dataclass(frozen=True)
class Names:
    """Public ids as an answer states them, and the UUID of its database; None: not stated."""

    database: str | None = None
    run: str | None = None
    question: str | None = None


@dataclass(frozen=True)
class Place:
    """A question with its numbers here and the names that mean the same everywhere."""

    query: int
    run: int
    database: str
    run_public_id: str
    query_public_id: str


UNSTATED = Names()


def find_place(session: Session, query: int | str, names: Names = UNSTATED) -> Place:
    """Return the question of a number or a public id, if it is the one that an answer names.

    Raises:
        DamagedRowError: the identity of this database cannot be read.
        ElsewhereError: it, its run or this database is another one than what is named.
        NotFound: there is no question of this number, and nothing else was named.
    """
    if isinstance(query, str):
        row = session.execute(_BY_PUBLIC_ID, {"query": query}).one_or_none()
    else:
        row = session.execute(_BY_NUMBER, {"query": query}).one_or_none()
    if row is None:
        raise DamagedRowError(UNREADABLE)
    stated(row.database)
    missing = row.query is None or row.run_public_id is None
    if _differs(row, names) or (missing and isinstance(query, str)):
        raise ElsewhereError
    if missing:
        raise NotFound(mark("There is no question {question}."), question=query)
    return Place(**row._mapping)


def _differs(row: Row[str, int, int, str, str], names: Names) -> bool:
    """Return whether anything that is named is not what was found; where nothing is found, all is."""
    stated = (names.database, names.run, names.question)
    found = (row.database, row.run_public_id, row.query_public_id)
    return any(name is not None and name != here for name, here in zip(stated, found, strict=True))


# Statements that every answer needs are built once. They join the only row of `Identity`, and no run that is
# being deleted: what is answered there would go with it.
_IDENTITY, _QUERY, _RUN = (Table.metadata.tables[one.__tablename__] for one in (Identity, Query, Run))
_PLACE = select(
    _IDENTITY.c.uuid.label("database"),
    _QUERY.c.id.label("query"),
    _QUERY.c.run_id.label("run"),
    _RUN.c.public_id.label("run_public_id"),
    _QUERY.c.public_id.label("query_public_id"),
).select_from(_IDENTITY)
_ITS_RUN = and_(_RUN.c.id == _QUERY.c.run_id, _RUN.c.deleting.is_(None))
_BY_NUMBER = _PLACE.outerjoin(_QUERY, _QUERY.c.id == bindparam("query")).outerjoin(_RUN, _ITS_RUN)
_BY_PUBLIC_ID = _PLACE.outerjoin(_QUERY, _QUERY.c.public_id == bindparam("query")).outerjoin(_RUN, _ITS_RUN)
