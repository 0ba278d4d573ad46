"""Jobs: what pages ask of any worker, such as a walk of the present policy. Each verb is one transaction.

A job touches no life: it reads a run's last checkpoint and writes its own row alone. Workers claim jobs by
the same rules as runs: a claim increments the fencing token and holds while its worker gives signs of life.
The job of a killed worker is taken by another, up to `TRIES` times. All is bounded: the open jobs of a run,
the seconds for which a job waits and for which its result is kept, and the result's size.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from sqlalchemy import (
    ColumnElement,
    Select,
    and_,
    bindparam,
    delete,
    exists,
    func,
    or_,
    select,
    true,
    tuple_,
    update,
)
from sqlalchemy.orm import Session

from parenting.drawing.sentences import mark
from parenting.server.batches import refuse_if_of_batch
from parenting.server.damage import damage, readable
from parenting.server.db import Database
from parenting.server.errors import Conflict, LostClaimError, NotFound
from parenting.server.runs import CLAIM_SECONDS, find, lock
from parenting.server.statuses import JobState
from parenting.server.store.clock import Mark, is_over
from parenting.server.store.relay import announce
from parenting.server.tables import Job

OPEN_OF_A_RUN = 4
"""Jobs of a run that may be open at once."""
WAITS_SECONDS = 60.0
"""A job that no worker has taken for so long has failed: nobody waits for it any more."""
KEPT_SECONDS = 600.0
"""A job is deleted so long after it was asked."""
NO_RUN = 0
"""The run of a job that belongs to none. Such a job takes minutes, and a worker does one at a time."""
KEPT_OF_A_RUN = 20
"""Jobs of a run that are kept at most; the oldest go first."""
TRIES = 3
"""Workers that may take a job, one after another, before it has failed."""
RESULT_BYTES = 2_000_000
"""A result has at most this many characters."""
OPEN = (JobState.WAITING, JobState.WORKING)
CANCELLED = mark("It was cancelled.")
NOT_TAKEN = mark("No worker took it within a minute. Start one (parenting worker) and ask again.")
GIVEN_UP = mark("Three workers ended while they were at it. Ask again, or look into the worker's log.")


@dataclass(frozen=True, eq=False)
class JobClaim:
    """A worker's right to finish a job, until another claims it."""

    job_id: int
    run_id: int
    kind: str
    payload: dict[str, Any]
    worker: str
    fencing_token: int


def ask(db: Database, run_id: int, kind: str, payload: dict[str, Any], client_id: str) -> Job:
    """Add a job of a run, with a payload of its kind (`server.job_kinds`).

    Raises:
        NotFound: there is no such run.
        Conflict: too many jobs of this run are open, or it is a trial of a batch.
    """
    with db.write() as session:
        lock(session, run_id)
        refuse_if_of_batch(find(session, run_id))
        return _add(session, db, run_id, kind, payload, client_id)


def ask_of_no_run(db: Database, kind: str, payload: dict[str, Any], client_id: str) -> Job:
    """Add a job that belongs to no run; the same one that is open or done is returned instead.

    Raises:
        Conflict: too many of them are open.
    """
    with db.write() as session:
        same = select(Job).where(Job.run_id == NO_RUN, Job.kind == kind, Job.state != JobState.FAILED)
        for job in session.scalars(same.order_by(Job.id.desc())):
            if damage(job) is None and job.payload == payload:
                return job
        return _add(session, db, NO_RUN, kind, payload, client_id)


def _add(
    session: Session, db: Database, run_id: int, kind: str, payload: dict[str, Any], client_id: str
) -> Job:
    mark = db.mark(session)
    _sweep(session, mark)
    opened = select(func.count()).where(Job.run_id == run_id, Job.state.in_(OPEN))
    if (session.scalar(opened) or 0) >= OPEN_OF_A_RUN:
        whose = "of this run" if run_id else "of this kind"
        raise Conflict(f"{OPEN_OF_A_RUN} jobs {whose} wait for a worker already. Wait until one is done.")
    job = Job(run_id=run_id, kind=kind, payload=payload, client_id=client_id, created=db.clock())
    job.asked_epoch, job.asked_mark = mark.epoch, mark.seconds
    session.add(job)
    session.flush()
    newest = select(Job.id).where(Job.run_id == run_id).order_by(Job.id.desc()).limit(KEPT_OF_A_RUN)
    kept = session.scalars(newest).all()
    session.execute(delete(Job).where(Job.run_id == run_id, Job.id.not_in(kept)))
    announce(session, "worker")
    return job


def get(db: Database, public_id: str) -> Job:
    """Return a job.

    Raises:
        NotFound: there is none of this id, or none any more.
        DamagedRowError: its row cannot be read.
    """
    with db.read() as session:
        job = session.scalars(select(Job).where(Job.public_id == public_id)).one_or_none()
    if job is None:
        raise NotFound("There is no such job. A job is kept for ten minutes; ask again.")
    return readable(job)


def waits(db: Database, seconds: float = CLAIM_SECONDS, long: bool = True) -> bool:
    """Return whether there is a job to claim, of a run or, if `long`, of none. This takes no lock."""
    with db.read() as session:
        return bool(session.scalar(_any_free(seconds, long), db.mark(session).bound()))


@cache
def _any_free(seconds: float, long: bool) -> Select[tuple[bool]]:
    """Return the statement of `waits`, which a worker asks many times a second."""
    return select(exists().where(_free(seconds), true() if long else Job.run_id != NO_RUN))


def claim(
    db: Database, worker: str, most: int, seconds: float = CLAIM_SECONDS, long: bool = True
) -> Sequence[JobClaim]:
    """Claim the oldest jobs that wait, or whose worker was silent for `seconds`; at most `most`.

    At most one of them belongs to no run, and none unless `long`.
    """
    found = _claim(db, worker, most, seconds, Job.run_id != NO_RUN)
    if long and len(found) < most:
        found += _claim(db, worker, 1, seconds, Job.run_id == NO_RUN)
    return found


def _claim(db: Database, worker: str, most: int, seconds: float, of: ColumnElement[bool]) -> list[JobClaim]:
    with db.write(durable=False) as session:
        mark = db.mark(session)
        _sweep(session, mark)
        rows = select(Job).where(_free(seconds), of).order_by(Job.id).limit(most)
        found = session.scalars(rows.with_for_update(skip_locked=True), mark.bound()).all()
        return [mine for job in found if (mine := _take(job, worker, mark)) is not None]


def _take(job: Job, worker: str, mark: Mark) -> JobClaim | None:
    """Give a worker a job, unless it cannot be read or too many have tried."""
    found = damage(job)
    if found is not None:
        job.state, job.reason = JobState.FAILED, f"Its stored row is damaged: {found}."
        return None
    if job.fencing_token >= TRIES:
        job.state, job.reason = JobState.FAILED, GIVEN_UP
        return None
    job.state, job.worker, job.fencing_token = JobState.WORKING, worker, job.fencing_token + 1
    job.claim_epoch, job.claim_mark = mark.epoch, mark.seconds
    return JobClaim(job.id, job.run_id, job.kind, job.payload, worker, job.fencing_token)


def renew(db: Database, claims: Sequence[JobClaim]) -> None:
    """Renew claims, as signs of life; those that another worker has taken are left alone."""
    if claims:
        with db.write(durable=False) as session:
            mark = db.mark(session)
            sign = {"claim_epoch": mark.epoch, "claim_mark": mark.seconds}
            session.execute(update(Job).where(_of(claims)).values(sign))


def let_go(db: Database, claims: Sequence[JobClaim]) -> None:
    """Give back what a worker that ends in order has not finished: another takes it at once."""
    if claims:
        free = {"state": JobState.WAITING, "worker": None, "claim_epoch": None, "claim_mark": None}
        with db.write() as session:
            session.execute(update(Job).where(_of(claims)).values(free))
            announce(session, "worker")


def tell(db: Database, mine: JobClaim, progress: dict[str, Any]) -> None:
    """Store the progress of a job, in the place of its result to come.

    Raises:
        LostClaimError: it was cancelled, or another worker has it.
    """
    _set(db, mine, result=progress)


def cancel(db: Database, public_id: str) -> Job:
    """End an open job without a result; its worker leaves it when it next tells how far it is.

    Raises:
        NotFound: there is none of this id, or none any more.
        Conflict: it is over.
    """
    ended = {"state": JobState.FAILED, "reason": CANCELLED, "result": None}
    with db.write() as session:
        opened = update(Job).where(Job.public_id == public_id, Job.state.in_(OPEN))
        found = session.execute(opened.values(ended).returning(Job.id)).all()
    job = get(db, public_id)
    if not found:
        raise Conflict("This job is over already.")
    return job


def finish(db: Database, mine: JobClaim, result: dict[str, Any]) -> None:
    """Store the result of a job; one that is too large makes it fail.

    Raises:
        LostClaimError: another worker has the job now, or it is kept no longer.
    """
    size = len(json.dumps(result, separators=(",", ":")))
    if size > RESULT_BYTES:
        fail(db, mine, f"Its result has {size} characters, and {RESULT_BYTES} are kept at most.")
        return
    _set(db, mine, state=JobState.DONE, result=result)


def fail(db: Database, mine: JobClaim, reason: str) -> None:
    """End a job without a result; the reason is a sentence for people.

    Raises:
        LostClaimError: another worker has the job now, or it is kept no longer.
    """
    _set(db, mine, state=JobState.FAILED, reason=reason, result=None)


def hold(session: Session, mine: JobClaim) -> None:
    """Lock a job in a transaction that writes what it made.

    Raises:
        LostClaimError: it was cancelled, or another worker has it.
    """
    if session.execute(select(Job.id).where(_of([mine])).with_for_update()).scalar() is None:
        raise _lost(mine)


def _set(db: Database, mine: JobClaim, **values: Any) -> None:
    with db.write(durable=False) as session:
        mine_still = session.execute(update(Job).where(_of([mine])).values(values).returning(Job.id)).all()
        if not mine_still:
            raise _lost(mine)


def _lost(mine: JobClaim) -> LostClaimError:
    return LostClaimError(f"Job {mine.job_id} was cancelled, is another worker's now, or is not kept.")


def _of(claims: Sequence[JobClaim]) -> ColumnElement[bool]:
    """Return the condition that a job is one of these claims', and the claim still holds."""
    held = tuple_(Job.id, Job.worker, Job.fencing_token)
    named = [(mine.job_id, mine.worker, mine.fencing_token) for mine in claims]
    return and_(Job.state == JobState.WORKING, held.in_(named))


def _free(seconds: float) -> ColumnElement[bool]:
    """Return the condition that a job may be claimed, at the mark that is bound."""
    silent = is_over(Job.claim_epoch, Job.claim_mark, Job.claim_mark + seconds)
    return or_(Job.state == JobState.WAITING, and_(Job.state == JobState.WORKING, silent))


def _sweep(session: Session, mark: Mark) -> None:
    """Delete jobs that are kept no longer, and give up those that nobody has taken in time."""
    old = delete(Job).where(
        Job.state != JobState.WORKING,
        is_over(Job.asked_epoch, Job.asked_mark, Job.asked_mark + KEPT_SECONDS),
    )
    session.execute(old, mark.bound())
    late = and_(
        Job.state == JobState.WAITING,
        Job.run_id != NO_RUN,  # another one of these may go on for minutes
        is_over(Job.asked_epoch, Job.asked_mark, Job.asked_mark + WAITS_SECONDS),
    )
    given_up = {"state": JobState.FAILED, "reason": bindparam("not_taken")}
    session.execute(update(Job).where(late).values(given_up), {**mark.bound(), "not_taken": NOT_TAKEN})
