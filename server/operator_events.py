"""The operator's events of a run: add one, list them. The worker applies them (`queue.worker_side`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from parenting.agent.events import EndEpisode
from parenting.server.audit.recording import record
from parenting.server.audit.table import Kind
from parenting.server.damage import readable
from parenting.server.db import Database
from parenting.server.errors import Conflict
from parenting.server.runs import living
from parenting.server.statuses import Waiting
from parenting.server.store.relay import announce
from parenting.server.tables import OperatorEvent, Run


def add_operator_event(db: Database, run_id: int, kind: str, payload: dict[str, Any]) -> OperatorEvent:
    """Store an operator event (agent.events); the worker applies it before the run's next tick.

    Raises:
        NotFound: there is no such run.
        Conflict: the run is over, or the event would end its last stage.
    """
    with db.write() as session:
        run = readable(living(session, run_id))
        if kind == "mature" and run.maturity >= run.config["stages"]:
            raise Conflict(
                f"The run is in its last stage, T = {run.maturity}, which never ends. "
                "The number of stages is set when a run is started (config.max_clip_length)."
            )
        return _add(db, session, run, kind, payload)


def end_episode_that_stands_still(db: Database, run_id: int) -> None:
    """Let the episode end in which the agent stands still since no move was acceptable to its parent.

    Nothing happens where it goes on already, or its end is stored: of two presses the second may come late.

    Raises:
        NotFound: there is no such run.
        Conflict: the run is over.
    """
    happens = EndEpisode()
    with db.write() as session:
        run = readable(living(session, run_id))
        pending = select(OperatorEvent.id).where(
            OperatorEvent.run_id == run_id,
            OperatorEvent.kind == happens.kind,
            OperatorEvent.applied_tick.is_(None),
        )
        if run.waiting in (Waiting.STUCK, Waiting.UNSURE) and session.scalar(pending.limit(1)) is None:
            _add(db, session, run, happens.kind, happens.model_dump(mode="json"))


def _add(db: Database, session: Session, run: Run, kind: str, payload: dict[str, Any]) -> OperatorEvent:
    event = OperatorEvent(run_id=run.id, kind=kind, payload=payload, created=db.clock())
    session.add(event)
    session.flush()
    record(db, session, Kind.OPERATOR, _told(kind, payload), run)
    announce(session, "worker")
    return event


def _told(kind: str, payload: dict[str, Any]) -> str:
    values = (f"{value}" for name, value in payload.items() if name != "kind")
    return " ".join([kind.replace("_", " "), *values])


def list_operator_events(db: Database, run_id: int) -> Sequence[OperatorEvent]:
    """Return the operator events of a run, in their order."""
    with db.read() as session:
        rows = select(OperatorEvent).where(OperatorEvent.run_id == run_id)
        return session.scalars(rows.order_by(OperatorEvent.id)).all()
