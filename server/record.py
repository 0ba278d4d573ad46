"""Verbs on events, metrics and checkpoints. One transaction each; all their SQL is here."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import delete, select

from parenting.server.db import Database
from parenting.server.errors import Conflict
from parenting.server.runs import Claim, find, held, living
from parenting.server.tables import Checkpoint, Event, Metric

KEPT = 2
"""Checkpoints kept of a run: the last, and one before it in case the last is damaged."""


@dataclass(frozen=True)
class Saved:
    """A checkpoint as it was read back; `intact` says whether its bytes are those that were written."""

    tick: int
    blob: bytes
    intact: bool


def add_event(db: Database, run_id: int, kind: str, payload: dict[str, Any]) -> Event:
    """Record what the operator did (agent.events); the worker applies it before the run's next tick.

    Raises:
        NotFound: there is no such run.
        Conflict: the run is over, or it is told to mature in its last stage.
    """
    with db.write() as session:
        run = living(session, run_id)
        if kind == "mature" and run.maturity >= run.config["stages"]:
            raise Conflict(
                f"Run {run_id} is in its last stage, T = {run.maturity}; it never ends. "
                "How many stages there are is said at the start (config.stages)."
            )
        event = Event(run_id=run_id, kind=kind, payload=payload, created=db.clock())
        session.add(event)
        session.flush()
        return event


def list_events(db: Database, run_id: int) -> Sequence[Event]:
    """The operator's events of a run, in their order."""
    with db.read() as session:
        return session.scalars(select(Event).where(Event.run_id == run_id).order_by(Event.id)).all()


def write_metrics(db: Database, mine: Claim, rows: Mapping[int, Mapping[str, float | int | None]]) -> None:
    """Store what was measured, by tick.

    A tick that is lived again replaces its row; what is not finite becomes null.

    Raises:
        LostClaimError: another worker raises this run now.
    """
    with db.write(durable=False) as session:
        run = held(session, mine)
        session.execute(delete(Metric).where(Metric.run_id == run.id, Metric.tick.in_(list(rows))))
        session.add_all(
            Metric(run_id=run.id, tick=tick, values=_finite(values)) for tick, values in rows.items()
        )


def metrics(db: Database, run_id: int, after: int = -1, limit: int = 10_000) -> Sequence[Metric]:
    """The metrics of the ticks after `after`, in their order, at most `limit`.

    Raises:
        NotFound: there is no such run.
    """
    with db.read() as session:
        find(session, run_id)
        rows = select(Metric).where(Metric.run_id == run_id, Metric.tick > after)
        return session.scalars(rows.order_by(Metric.tick).limit(limit)).all()


def save_checkpoint(db: Database, mine: Claim, tick: int, blob: bytes) -> None:
    """Store the state after a tick, with its hash, and forget all but the last two.

    A tick saved again is replaced.

    Raises:
        LostClaimError: another worker raises this run now.
    """
    digest = hashlib.sha256(blob).hexdigest()
    with db.write(durable=False) as session:
        run = held(session, mine)
        session.execute(delete(Checkpoint).where(Checkpoint.run_id == run.id, Checkpoint.tick == tick))
        session.add(Checkpoint(run_id=run.id, tick=tick, blob=blob, sha256=digest, created=db.clock()))
        session.flush()
        newest = (
            select(Checkpoint.id)
            .where(Checkpoint.run_id == run.id)
            .order_by(Checkpoint.id.desc())
            .limit(KEPT)
        )
        kept = session.scalars(newest).all()
        session.execute(delete(Checkpoint).where(Checkpoint.run_id == run.id, Checkpoint.id.not_in(kept)))


def load_checkpoints(db: Database, run_id: int) -> Sequence[Saved]:
    """The kept checkpoints, newest first.

    The caller takes the first intact one, and says so if it had to pass one over.
    """
    with db.read() as session:
        rows = session.scalars(
            select(Checkpoint).where(Checkpoint.run_id == run_id).order_by(Checkpoint.id.desc())
        ).all()
        return [Saved(row.tick, row.blob, hashlib.sha256(row.blob).hexdigest() == row.sha256) for row in rows]


def _finite(values: Mapping[str, float | int | None]) -> dict[str, Any]:
    return {name: value if value is None or math.isfinite(value) else None for name, value in values.items()}
