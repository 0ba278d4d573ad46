"""Corrections on the worker's side: an answer in the place of one that the agent has heard.

A correction has a tick of its own, as an answer has, and repeats at that tick in a replay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import BindParameter, bindparam, select
from sqlalchemy.orm import Session

from parenting.server.db import Database
from parenting.server.queue.lived_ticks import closed
from parenting.server.queue.queries import withdraw_guidance_in
from parenting.server.queue.taken import Taken, heard_before, recorded_at, standing_at
from parenting.server.runs import Claim, held, held_status
from parenting.server.statuses import QueryStatus
from parenting.server.tables import Answer, Query


@dataclass(frozen=True)
class Corrected:
    """A correction that is heard at a tick, with its query."""

    answer: Answer
    query: Query
    replaced: Answer  # which the agent has heard
    standing: Sequence[Taken]  # all that stand from this tick on, in the order in which they were heard


_RUN: BindParameter[int] = bindparam("run_id")
_CORRECTION = (
    select(Answer, Query)
    .join(Query, Answer.query_id == Query.id)
    .where(Answer.run_id == _RUN, Answer.applied_tick.is_(None), Answer.standing)
    .where(Query.status == QueryStatus.APPLIED)
    .order_by(Answer.number)
    .limit(1)
)


def take_correction(db: Database, mine: Claim, tick: int) -> Corrected | None:
    """Return the correction to be heard at this tick, or None: the oldest, or on replay the recorded one.

    A correction has a tick of its own, as an answer has. A new one is marked with it in the same transaction.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    with db.write(durable=False) as session:
        if closed(session, mine.run_id, tick):
            found = recorded_at(session, mine.run_id, tick)
            replaced = None if found is None else heard_before(session, found.answer)
            return None if found is None or replaced is None else _corrected(session, found, replaced, tick)
        held_status(session, mine)
        row = session.execute(_CORRECTION, {"run_id": mine.run_id}).first()
        if row is None:
            return None
        found = Taken(*row)
        replaced = heard_before(session, found.answer)
        found.answer.applied_tick = tick
        session.flush()
        db.outlive_crash(session)
        return None if replaced is None else _corrected(session, found, replaced, tick)


def withdraw_guidance(db: Database, mine: Claim, tick: int) -> None:
    """Withdraw the open guidance query of a pause that a correction has ended or turned at this tick.

    A replayed tick leaves what was asked since: the agent waits for that.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    with db.write() as session:
        held(session, mine)
        withdraw_guidance_in(session, mine.run_id, tick)


def _corrected(session: Session, found: Taken, replaced: Answer, tick: int) -> Corrected:
    return Corrected(found.answer, found.query, replaced, standing_at(session, replaced.run_id, tick))
