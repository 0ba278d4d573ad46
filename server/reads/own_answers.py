"""The standing answers that one client may change: its own, and any skip."""

from __future__ import annotations

from sqlalchemy import Select, or_, select

from parenting.server.db import Database
from parenting.server.reads.answers import Answered
from parenting.server.tables import SKIP, Answer, Query


def last_of(db: Database, run_id: int, client_id: str) -> Answered | None:
    """Return the last standing answer that this client gave in a run, if its row can be read."""
    rows = _standing().where(Answer.client_id == client_id, Answer.run_id == run_id)
    return _first(db, rows.order_by(Answer.number.desc()))


def changeable(db: Database, query_id: int, client_id: str) -> Answered | None:
    """Return the answer that stands for a query, if this client gave it or it is a skip, and can be read."""
    mine = or_(Answer.client_id == client_id, Answer.choice == SKIP)
    return _first(db, _standing().where(Answer.query_id == query_id, mine))


def _standing() -> Select[Answer, Query]:
    return select(Answer, Query).join(Query, Answer.query_id == Query.id).where(Answer.standing)


def _first(db: Database, rows: Select[Answer, Query]) -> Answered | None:
    with db.read() as session:
        row = session.execute(rows.limit(1)).first()
    found = None if row is None else Answered(row[0], row[1])
    return found if found is None or found.damage is None else None
