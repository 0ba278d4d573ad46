"""Numbers of runs and questions from their public ids. Addresses may carry either."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import bindparam, select
from sqlalchemy.orm import Session

from parenting.drawing.sentences import mark
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.tables import Query, Run


def run_number(db: Database, name: int | str) -> int:
    """Return the number of a run: a number itself, or the number that a public id belongs to.

    Raises:
        NotFound: no run has this public id. Whether a run has the number is for its reader to say.
    """
    return name if isinstance(name, int) else _number(db, Run, name, "run")


def run_number_in(session: Session, name: int | str) -> int:
    """Return the number of a run as `run_number` does, in a transaction that is already open."""
    return name if isinstance(name, int) else _number_in(session, Run, name, "run")


def query_number(db: Database, name: int | str) -> int:
    """Return the number of a question, as `run_number` does.

    Raises:
        NotFound: no question has this public id.
    """
    return name if isinstance(name, int) else _number(db, Query, name, "question")


def query_numbers(db: Database, names: Sequence[str]) -> list[int]:
    """Return the numbers of those questions that are here; an id of another database has none."""
    if not names:
        return []
    with db.read() as session:
        return list(session.scalars(select(Query.id).where(Query.public_id.in_(names))))


def is_there(session: Session, run_id: int) -> bool:
    """Return whether a run of this number is there and is not being deleted, in an open transaction."""
    return session.execute(_THERE, {"run_id": run_id}).scalar() is not None


def require_run(session: Session, run_id: int) -> None:
    """Raise NotFound where `is_there` says no."""
    if not is_there(session, run_id):
        raise NotFound(mark("There is no run {run}."), run=run_id)


def _number(db: Database, table: type[Run] | type[Query], name: str, kind: str) -> int:
    with db.read() as session:
        return _number_in(session, table, name, kind)


def _number_in(session: Session, table: type[Run] | type[Query], name: str, kind: str) -> int:
    number: int | None = session.execute(_NUMBERS[table], {"name": name}).scalar()
    if number is None:
        raise NotFound(f"There is no {kind} {name} in this database.")
    return number


# Statements that every request needs are built once, and of plain columns, which take less time.
_NUMBERS = {
    table: select(table.__table__.c.id).where(table.__table__.c.public_id == bindparam("name"))
    for table in (Run, Query)
}
_RUN = Run.__table__.c
_THERE = select(_RUN.id).where(_RUN.id == bindparam("run_id"), _RUN.deleting.is_(None))
