"""Failures of runs and how ended runs go on, each in a transaction that holds the run.

The log keeps the reasons.
"""

from __future__ import annotations

from sqlalchemy.exc import StatementError
from sqlalchemy.orm import Session

from parenting.server.batches import refuse_if_of_batch
from parenting.server.damage import damage, readable, sound
from parenting.server.db import Database
from parenting.server.notes import Failed, Resumed, add_note
from parenting.server.queue.queries import reopen_in, withdraw_in
from parenting.server.statuses import RunStatus
from parenting.server.tables import Run


def said_by(error: Exception) -> str:
    """Return what an error says for people: of a statement its cause alone, without SQL and parameters."""
    if not isinstance(error, StatementError):
        return str(error)
    cause = error.orig or error
    first = str(cause).partition("\n")[0] if error.orig else ""
    return f"{type(cause).__name__}: {first}" if first else type(cause).__name__


def note_failure(session: Session, db: Database, run: Run, reason: str) -> None:
    """Write the reason of a failure into the run's log, at the last tick reported."""
    add_note(session, db, run.id, sound(run, "tick") or 0, Failed(reason=reason))


def fail_if_damaged(session: Session, db: Database, run: Run) -> bool:
    """End a run whose row cannot be read, with that reason; return whether it was so."""
    found = damage(run)
    if found is None:
        return False
    run.status, run.reason = RunStatus.FAILED, f"Its stored row is damaged: {found}."
    run.worker = run.heartbeat = run.waiting = None
    withdraw_in(session, run.id)
    note_failure(session, db, run, run.reason)
    return True


def resume_in(session: Session, db: Database, run: Run) -> None:
    """Let a stopped or failed run go on: what was withdrawn when it ended is asked again.

    The worker takes it up from its last good checkpoint (`server.recall`).

    Raises:
        DamagedRowError: its row cannot be read.
        Conflict: it is a trial of a batch, which has no checkpoint.
    """
    refuse_if_of_batch(readable(run))
    reopen_in(session, run.id)
    add_note(session, db, run.id, run.tick, Resumed())
    run.status, run.reason = RunStatus.ACTIVE, None
