"""Verbs on runs: the operator's (pause, resume, stop) and the worker's (claim, let go, finish).

Exactly one worker raises a run: `claim` increments the run's fencing token, and every later write of a worker
checks the token inside its own transaction (`held`). So a worker that slept past its claim cannot write.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, and_, bindparam, exists, or_, select, tuple_, update
from sqlalchemy.orm import Session

from parenting.drawing.sentences import mark
from parenting.server.audit.recording import operated
from parenting.server.damage import readable, sound
from parenting.server.db import Database
from parenting.server.errors import Conflict, LostClaimError, NotFound
from parenting.server.failures import fail_if_damaged, note_failure, resume_in
from parenting.server.queue.queries import withdraw_in
from parenting.server.run_limits import require_room
from parenting.server.statuses import LIVING, OVER, RESUMABLE, VERBS, RunStatus
from parenting.server.store.clock import holds, is_over
from parenting.server.store.relay import announce
from parenting.server.tables import Run, Table, Worker

CLAIM_SECONDS = 5.0


@dataclass(frozen=True)
class Claim:
    """A worker's right to raise a run, until another claims it. Every write of a worker needs one."""

    run_id: int
    worker: str
    fencing_token: int


_LOCKED = select(Run.id).where(Run.id == bindparam("run_id"), Run.deleting.is_(None)).with_for_update()
_RUN = Table.metadata.tables[Run.__tablename__].c  # a statement on a table costs half of one on a class
_MINE = select(_RUN.status).where(
    _RUN.id == bindparam("run_id"),
    _RUN.worker == bindparam("worker"),
    _RUN.fencing_token == bindparam("fencing_token"),
)
_MINE = _MINE.with_for_update()


def list_runs(db: Database, limit: int = 200) -> Sequence[Run]:
    """Return the runs, newest first."""
    with db.read() as session:
        return session.scalars(select(Run).order_by(Run.id.desc()).limit(limit)).all()


def get_run(db: Database, run_id: int) -> Run:
    """Return one run.

    Raises:
        NotFound: there is none of this id.
        DamagedRowError: its row cannot be read.
    """
    return readable(stored_run(db, run_id))


def stored_run(db: Database, run_id: int) -> Run:
    """Return one run, whether its row can be read or not.

    Raises:
        NotFound: there is none of this id.
    """
    with db.read() as session:
        return find(session, run_id)


def set_status(
    db: Database, run_id: int, status: RunStatus, reason: str | None = None, most: int | None = None
) -> Run:
    """Pause, resume (`active`) or stop a run, for the operator.

    A second call changes nothing. Stopping withdraws the open queries. A stopped or failed run goes on from
    its last good checkpoint, its withdrawn queries are open again, and its log says so. `most` is the number
    of runs that may live (None: any).

    Raises:
        TooManyRunsError: it is over, and as many live as may.
        NotFound: there is no such run.
        Conflict: it is over for another reason.
        DamagedRowError: it was stopped or has failed, and its row cannot be read.
    """
    with db.write() as session:
        before = (run := hold(session, run_id)).status
        if before in RESUMABLE and status is RunStatus.ACTIVE:
            if most is not None:
                require_room(session, most)
            resume_in(session, db, run)
        if run.status in OVER and run.status != status:
            raise Conflict(
                mark("This run is {now}; it cannot become {status}."), now=run.status, status=status
            )
        if run.status != status:
            become(session, run, status, reason)
        if before != status:
            operated(db, session, VERBS.get(status, status), run)
            announce(session, "worker")
        return run


def set_goal(db: Database, run_id: int, goal: int | None) -> Run:
    """Let a run rest once this many questions are answered; None removes the goal.

    Raises:
        NotFound: there is no such run.
        Conflict: it is over.
    """
    with db.write() as session:
        run = living(session, run_id)
        run.goal = goal
        operated(db, session, f"goal {goal or 'none'}", run)
        announce(session, "worker")
        return run


def set_pace(db: Database, run_id: int, pace: float | None) -> Run:
    """Limit the ticks in a second; None removes the limit.

    Raises:
        NotFound: there is no such run.
        Conflict: it is over.
    """
    with db.write() as session:
        run = living(session, run_id)
        run.pace = pace
        operated(db, session, f"pace {pace or 'none'}", run)
        announce(session, "worker")
        return run


def free(seconds: Any) -> ColumnElement[bool]:
    """Return the condition that a run may be claimed, at the mark that is bound."""
    return and_(Run.status.in_(LIVING), silent(seconds))


def silent(seconds: Any) -> ColumnElement[bool]:
    """Return the condition that nobody raises a run, at the mark that is bound.

    A claim holds for so many seconds after it was given or the worker wrote to the run, and after each sign
    of life of the worker: a run that waits needs none of its own.
    """
    claimed = is_over(Run.claim_epoch, Run.claim_mark, Run.claim_mark + seconds)
    signed = holds(Worker.epoch, Worker.mark, Worker.mark + seconds)
    lives = exists().where(Worker.name == Run.worker, signed).correlate(Run)
    return or_(Run.worker.is_(None), and_(claimed, ~lives))


def claim(
    db: Database,
    worker: str,
    seconds: float = CLAIM_SECONDS,
    most: int | None = None,
    but: Collection[int] = (),
) -> Sequence[Claim]:
    """Claim runs that are not over and are free, or whose worker was silent for `seconds`.

    This takes the write lock: `work.sharing` looks before whether there is one.

    Args:
        db: The database.
        worker: The name of the worker that claims them.
        seconds: How long a claim holds without a sign of life.
        most: How many runs to claim at most; None claims all.
        but: Runs to leave alone.
    """
    with db.write() as session:
        # A run that somebody has locked is in use: its turn comes with the next look.
        rows = (
            select(Run)
            .where(free(seconds), Run.id.not_in(but))
            .order_by(Run.id)
            .limit(most)
            .with_for_update(skip_locked=True)
        )
        mark = db.mark(session)
        found = session.scalars(rows.with_for_update(skip_locked=True), mark.bound())
        runs = [run for run in found if not fail_if_damaged(session, db, run)]
        for run in runs:
            run.worker, run.fencing_token = worker, run.fencing_token + 1
            run.heartbeat, run.claim_epoch, run.claim_mark = db.clock(), mark.epoch, mark.seconds
        return [Claim(run.id, worker, run.fencing_token) for run in runs]


def let_go(db: Database, claims: Sequence[Claim]) -> None:
    """Release claims, as at a worker's orderly end; runs that others have claimed since are left alone."""
    with db.write() as session:
        session.execute(
            update(Run)
            .where(_of(claims))
            .values(worker=None, heartbeat=None, claim_epoch=None, claim_mark=None)
        )


def _of(claims: Sequence[Claim]) -> ColumnElement[bool]:
    """Return the condition that a run is one of these claims', and the claim still holds."""
    held = tuple_(Run.id, Run.worker, Run.fencing_token)
    return held.in_([(mine.run_id, mine.worker, mine.fencing_token) for mine in claims])


def finish(db: Database, mine: Claim, status: RunStatus, reason: str, error: str | None = None) -> Run:
    """End a run as `finished` or `failed`, with a sentence for people and, if it failed, the details.

    The open queries are withdrawn.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    with db.write() as session:
        run = held(session, mine)
        if sound(run, "status") not in OVER:
            become(session, run, status, reason)
            run.error = error
            if status is RunStatus.FAILED:
                note_failure(session, db, run, reason)
        return run


def find(session: Session, run_id: int) -> Run:
    """Return one run, in an open transaction; raises NotFound, also where it is being deleted."""
    return _kept(session.get(Run, run_id), run_id)


def hold(session: Session, run_id: int) -> Run:
    """Return what `find` does, locked until the transaction ends (SQLite locks the whole file anyway)."""
    return _kept(session.get(Run, run_id, with_for_update=True), run_id)


def _kept(run: Run | None, run_id: int) -> Run:
    if run is None or sound(run, "deleting") is not None:
        raise NotFound(mark("There is no run {run}."), run=run_id)
    return run


def lock(session: Session, run_id: int) -> None:
    """Lock a run without reading it; raises NotFound, also where it is being deleted."""
    if session.execute(_LOCKED, {"run_id": run_id}).scalar() is None:
        raise NotFound(mark("There is no run {run}."), run=run_id)


def living(session: Session, run_id: int) -> Run:
    """Return one run, locked, if it is not over.

    Raises:
        NotFound: there is no such run.
        Conflict: it is over.
    """
    run = hold(session, run_id)
    if run.status in OVER:
        raise Conflict(mark("This run is {now}; its agent cannot be changed any more."), now=run.status)
    return run


def held(session: Session, mine: Claim) -> Run:
    """Return the run of a claim, locked, if the claim still holds. Every write of a worker begins here.

    Raises:
        LostClaimError: another worker trains this run now, or it was deleted.
    """
    try:
        run = hold(session, mine.run_id)
    except NotFound:
        raise LostClaimError(f"Run {mine.run_id} was deleted.") from None
    worker, token = sound(run, "worker"), sound(run, "fencing_token")
    if (worker, token) != (mine.worker, mine.fencing_token):
        raise LostClaimError(
            f"Run {run.id} is trained by {worker or 'no worker'} now "
            f"(fencing token {token}, not {mine.fencing_token})."
        )
    return run


def held_status(session: Session, mine: Claim) -> RunStatus:
    """Return the status of a claim's run, locked, if the claim still holds."""
    status: RunStatus | None = session.execute(_MINE, vars(mine)).scalar()
    return held(session, mine).status if status is None else status


def become(session: Session, run: Run, status: RunStatus, reason: str | None) -> None:
    """Give a run that is locked another status; the end of one withdraws its open queries."""
    run.status, run.reason = status, reason
    if status in OVER:
        run.waiting = None
        withdraw_in(session, run.id)
