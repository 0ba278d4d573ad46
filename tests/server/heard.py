"""The answers that an agent has heard, in their order: from these, dataset X can be rebuilt."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import select

from parenting.server.db import Database
from parenting.server.reads.answers import Answered
from parenting.server.tables import Answer, Query


def heard_answers(db: Database, run_id: int) -> Sequence[Answered]:
    """Return the answers of a run that have an `applied_tick`, by that tick."""
    rows = select(Answer, Query).join(Query, Answer.query_id == Query.id)
    rows = rows.where(Answer.run_id == run_id, Answer.applied_tick.is_not(None))
    with db.read() as session:
        return [Answered(*row) for row in session.execute(rows.order_by(Answer.applied_tick))]
