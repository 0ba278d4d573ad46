"""Numbers of runs and questions from their public ids. Addresses may carry either."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

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


def _number(db: Database, table: type[Run] | type[Query], name: str, kind: str) -> int:
    with db.read() as session:
        return _number_in(session, table, name, kind)


def _number_in(session: Session, table: type[Run] | type[Query], name: str, kind: str) -> int:
    number: int | None = session.execute(select(table.id).where(table.public_id == name)).scalar()
    if number is None:
        raise NotFound(f"There is no {kind} {name} in this database.")
    return number
