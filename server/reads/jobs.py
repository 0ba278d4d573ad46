"""Jobs as the API and the pages show them."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Literal

from parenting.server.db import Database
from parenting.server.schemas import Schema
from parenting.server.statuses import JobState
from parenting.server.tables import Job
from parenting.server.workers import alive


class ProgressSchema(Schema):
    """The progress of a job that takes minutes."""

    steps: int
    expected: int
    """The steps after which it is expected to be done; it may need fewer or more."""
    seconds: float
    """The seconds for which its worker has been at it."""


class JobSchema(Schema):
    """A job that was asked of any worker, and its result."""

    id: str
    """Its name: random, and never given again."""
    run: int | None
    """The run; null: the job belongs to none."""
    kind: str
    payload: dict[str, Any]
    """The arguments, with their defaults."""
    created: datetime
    state: JobState
    """waiting (no worker has taken it), working, done, or failed."""
    result: dict[str, Any] | None
    """The result; null until it is done. docs/api.md describes the result of each kind."""
    progress: ProgressSchema | None
    """The progress of pre-training; null: it has not told, or the job is not at work."""
    reason: str | None
    """The reason for its failure, in a sentence."""
    worker: Literal["alive", "silent"]
    """alive: a worker gives signs of life. silent: none does, so the job waits until one is started."""


def job_schema(db: Database, job: Job) -> JobSchema:
    """Return the schema of a job that can be read."""
    names = ("kind", "payload", "created", "state", "reason")
    at_work = job.state is JobState.WORKING
    progress = ProgressSchema(**job.result) if at_work and job.result is not None else None
    return JobSchema(
        id=job.public_id,
        run=job.run_id or None,
        worker="alive" if alive(db) else "silent",
        result=None if at_work else job.result,
        progress=progress,
        **{name: getattr(job, name) for name in names},
    )
