"""Answers that the agent has heard, each at its tick, with their queries."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from parenting.server.tables import Answer, Query


@dataclass(frozen=True)
class Taken:
    """An answer that is heard at a tick, with its query."""

    answer: Answer
    query: Query


def recorded_at(session: Session, run_id: int, tick: int) -> Taken | None:
    """Return the answer or correction that was heard at a tick."""
    rows = select(Answer, Query).join(Query, Answer.query_id == Query.id)
    row = session.execute(rows.where(Answer.run_id == run_id, Answer.applied_tick == tick)).one_or_none()
    return None if row is None else Taken(*row)


def heard_before(session: Session, answer: Answer) -> Answer | None:
    """Return the last answer to the same query that the agent heard before this one."""
    rows = select(Answer).where(Answer.query_id == answer.query_id, Answer.id != answer.id)
    if answer.applied_tick is not None:
        rows = rows.where(Answer.applied_tick < answer.applied_tick)
    rows = rows.where(Answer.applied_tick.is_not(None)).order_by(Answer.applied_tick.desc()).limit(1)
    return session.scalars(rows).first()


def standing_at(session: Session, run_id: int, tick: int) -> Sequence[Taken]:
    """Return the answers that stand after a tick, by the tick at which each was heard."""
    rows = select(Answer, Query).join(Query, Answer.query_id == Query.id)
    rows = rows.where(Answer.run_id == run_id, Answer.applied_tick <= tick).order_by(Answer.applied_tick)
    latest = {taken.query.id: taken for taken in (Taken(*row) for row in session.execute(rows))}
    return sorted(latest.values(), key=lambda taken: taken.answer.applied_tick or 0)
