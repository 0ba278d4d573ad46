"""The answers of one client that stand: the page shows them to whoever gave them."""

from __future__ import annotations

from sqlalchemy import Select, select

from parenting.server.db import Database
from parenting.server.reads.answers import Answered
from parenting.server.tables import Answer, Query


def last_of(db: Database, run_id: int, client_id: str) -> Answered | None:
    """Return the last standing answer that this client gave in a run, if its row can be read."""
    rows = _own(client_id).where(Answer.run_id == run_id).order_by(Answer.number.desc())
    return _first(db, rows)


def own_answer(db: Database, query_id: int, client_id: str) -> Answered | None:
    """Return the answer that stands for a query, if this client gave it and its row can be read."""
    return _first(db, _own(client_id).where(Answer.query_id == query_id))


def _own(client_id: str) -> Select[Answer, Query]:
    rows = select(Answer, Query).join(Query, Answer.query_id == Query.id)
    return rows.where(Answer.client_id == client_id, Answer.standing)


def _first(db: Database, rows: Select[Answer, Query]) -> Answered | None:
    with db.read() as session:
        row = session.execute(rows.limit(1)).first()
    found = None if row is None else Answered(row[0], row[1])
    return found if found is None or found.damage is None else None
