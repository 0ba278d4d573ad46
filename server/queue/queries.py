"""SQL on queries that both sides of the queue need, and that a run needs when it ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, case, func, select, update
from sqlalchemy.orm import InstrumentedAttribute, Session

from parenting.server.db import Database
from parenting.server.statuses import QueryStatus
from parenting.server.tables import SKIP, Answer, Query


@dataclass(frozen=True)
class Open:
    """The number of open queries of a run, by kind."""

    guidance: int
    preference: int


def open_counts(db: Database, run_id: int) -> Open:
    """Count the open queries of a run, by kind."""
    with db.read() as session:
        return open_in(session, run_id)


def open_in(session: Session, run_id: int) -> Open:
    """Count as `open_counts` does, in a transaction that is already open."""
    return open_by_run(session, [run_id])[run_id]


def open_by_run(session: Session, run_ids: Sequence[int]) -> dict[int, Open]:
    """Count as `open_in` does, for many runs at once."""
    rows = select(Query.run_id, Query.kind, func.count()).where(
        Query.status == QueryStatus.OPEN, Query.run_id.in_(run_ids)
    )
    counts = {(row[0], row[1]): row[2] for row in session.execute(rows.group_by(Query.run_id, Query.kind))}
    return {i: Open(counts.get((i, "guidance"), 0), counts.get((i, "preference"), 0)) for i in run_ids}


def withdraw_in(session: Session, run_id: int) -> None:
    """Withdraw a run's open queries as it ends, in a transaction that is already open."""
    rows = update(Query).where(Query.run_id == run_id, Query.status == QueryStatus.OPEN)
    session.execute(rows.values(status=QueryStatus.WITHDRAWN))


def withdraw_guidance_in(session: Session, run_id: int, tick: int) -> None:
    """Withdraw the guidance asked before a tick, since the agent waits for it no more; `reopen_in` leaves it.

    Where the run has just ended, what its end withdrew is marked as well.
    """
    rows = update(Query).where(Query.run_id == run_id, Query.kind == "guidance", Query.tick < tick)
    rows = rows.where(Query.status.in_((QueryStatus.OPEN, QueryStatus.WITHDRAWN)))
    rows = rows.where(Query.withdrawn_tick.is_(None))
    session.execute(rows.values(status=QueryStatus.WITHDRAWN, withdrawn_tick=tick))


def reopen_in(session: Session, run_id: int) -> None:
    """Ask again what was withdrawn when a run ended, in a transaction that is already open.

    Guidance that the agent waits for no more stays withdrawn: its episode was ended, or its pause was ended
    by a correction. So do clips that were skipped twice.
    """
    skipped = select(Answer.query_id).where(Answer.run_id == run_id, Answer.standing, Answer.choice == SKIP)
    rows = update(Query).where(Query.run_id == run_id, Query.status == QueryStatus.WITHDRAWN)
    rows = rows.where(Query.withdrawn_tick.is_(None), Query.id.not_in(skipped))
    nobody: dict[str, None] = dict.fromkeys(
        ("leased_by", "leased_until", "lease_epoch", "lease_begin", "lease_end")
    )
    session.execute(rows.values(status=QueryStatus.OPEN, **nobody))


def urgency() -> tuple[ColumnElement[Any] | InstrumentedAttribute[Any], ...]:
    """Return the order of questions: guidance first, then the oldest; what was put back comes last."""
    return guidance_first(), Query.put_back, Query.tick


def guidance_first() -> ColumnElement[int]:
    """Return the order of urgency by kind: an agent that waits for guidance does not act."""
    return case((Query.kind == "guidance", 0), else_=1)
