"""Trials that were raised in tensors, stored as runs that are over: their settings and their numbers.

No worker has raised such a run and none ever claims it. It has no questions, answers or checkpoints: it is
compared and drawn, and cannot go on, be replayed, or show its policy.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import select

from parenting.server.db import Database
from parenting.server.errors import Conflict
from parenting.server.identity import unused_number
from parenting.server.public_ids import public_id
from parenting.server.statuses import RunStatus
from parenting.server.tables import Metric, Run

SETTINGS = ("world", "level", "level_text", "legend", "brief", "config", "preset", "seed")
SHARED = frozenset((*SETTINGS, "script", "weights", "origin"))
"""The columns of a run that all trials of a batch share."""
FOREVER = "Only the numbers of a trial of a batch are kept: it has no questions, answers or checkpoints."


@dataclass(frozen=True)
class EndedTrial:
    """A trial, as it ended."""

    number: int
    ticks: int
    maturity: int
    optimal: bool
    answers: int
    finished: bool
    reason: str  # why it ended, in a sentence
    metrics: Mapping[int, Mapping[str, Any]]


def store_batch(
    db: Database, shared: Mapping[str, Any], trials: Iterable[EndedTrial], name: str | None = None
) -> list[int]:
    """Store each trial as a run, in a transaction of its own, and return their numbers.

    Raises:
        ValueError: `shared` has not the columns that all trials share.
    """
    if shared.keys() != SHARED:
        raise ValueError(f"A batch shares {', '.join(sorted(SHARED))}.")
    batch = public_id()
    return [_store(db, {**shared, "name": name, "batch": batch}, trial) for trial in trials]


def _store(db: Database, shared: Mapping[str, Any], trial: EndedTrial) -> int:
    with db.write() as session:
        run = Run(
            id=unused_number(session, Run),
            created=db.clock(),
            parent="scripted",
            trial=trial.number,
            status=RunStatus.FINISHED if trial.finished else RunStatus.STOPPED,
            reason=trial.reason,
            tick=trial.ticks,
            maturity=trial.maturity,
            optimal=trial.optimal,
            answers=trial.answers,
            **shared,
        )
        session.add(run)
        session.flush()
        session.add_all(
            Metric(run_id=run.id, tick=tick, values=dict(values)) for tick, values in trial.metrics.items()
        )
        return run.id


def trials_of(db: Database, batch: str, most: int) -> Sequence[int]:
    """Return the numbers of the runs of a batch that are left, the first of them, in their order."""
    of_batch = select(Run.id).where(Run.batch == batch, Run.deleting.is_(None))
    with db.read() as session:
        return session.scalars(of_batch.order_by(Run.id).limit(most)).all()


def refuse_if_of_batch(run: Run) -> None:
    """Refuse what needs the agent of a trial of a batch.

    Raises:
        Conflict: the run is one.
    """
    if run.batch is not None:
        raise Conflict(FOREVER)
