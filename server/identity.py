"""The identity of a database: a UUID that its migration drew, and numbers that are never given twice.

Run 3 and question 17 exist in every data folder. An answer therefore names the database, the run and the
question that it is meant for, and is refused elsewhere (`server.queue.answers`). A copy has the identity of
what it was copied from, until `renew` gives it one of its own: from then on, answers meant for the original
are refused here.
"""

from __future__ import annotations

import uuid

from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session

from parenting.server.columns import Damaged
from parenting.server.db import Database
from parenting.server.errors import DamagedRowError
from parenting.server.tables import Identity, Query, Run, Table

UNREADABLE = (
    "The identity of this database cannot be read, so no answer can be held to be meant for it. "
    "Restore a backup of before the damage."
)


def database_id(db: Database) -> str:
    """Return the UUID of a database."""
    with db.read() as session:
        return database_id_in(session)


def database_id_in(session: Session) -> str:
    """Return the UUID of a database, in a transaction that is already open.

    Raises:
        DamagedRowError: it cannot be read, so nobody can say which database this is.
    """
    return stated(session.execute(_UUID).scalar())


def stated(found: str | Damaged | None) -> str:
    """Return a UUID that was read, if it could be.

    Raises:
        DamagedRowError: it could not, or is not there.
    """
    if found is None or isinstance(found, Damaged):
        raise DamagedRowError(UNREADABLE)
    return found


def renew(db: Database) -> str:
    """Give a restored copy a UUID of its own and return it; the former one is kept beside it.

    The public ids of runs and questions stay. Pages that were opened before name the former UUID, so their
    answers are refused as being meant for another database.
    """
    with db.write() as session:
        mine = session.scalars(select(Identity).with_for_update()).one()
        mine.copied_from, mine.uuid, mine.since = mine.uuid, str(uuid.uuid4()), db.clock()
        return mine.uuid


def unused_number(session: Session, table: type[Run] | type[Query]) -> int | None:
    """Return the number of a new run or question, in a transaction that writes.

    SQLite would number a row after the largest that is still there, and so give a deleted one's number again.
    A trigger keeps the largest deleted number (`Identity`). None: the database's own counter never goes back.
    """
    if session.get_bind().dialect.name != "sqlite":
        return None
    number: int = session.execute(_LARGEST[table.__tablename__]).scalar_one()
    return number + 1


def _largest(table: str, deleted: str) -> Select[int]:
    tables = Table.metadata.tables
    kept = select(func.max(tables[table].c.id)).scalar_subquery()
    return select(func.max(func.coalesce(kept, 0), tables[Identity.__tablename__].c[deleted]))


_UUID = select(Identity.uuid)
_LARGEST = {name: _largest(name, f"last_{name}") for name in ("run", "query")}
