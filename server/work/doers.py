"""The work of each kind of job, by the kinds of `server.job_kinds`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from parenting.server.db import Database
from parenting.server.job_kinds import KINDS, OF_NO_RUN
from parenting.server.jobs import JobClaim
from parenting.server.work.episode import episode
from parenting.server.work.one_state import one_state
from parenting.server.work.pretraining import pretrain
from parenting.server.work.walk import policy, walk

Doer = Callable[[Database, int, Any], dict[str, Any]]
"""It reads the run of this id and returns a result; nothing else is written."""

DOERS: Mapping[str, Doer] = {
    "walk": walk,
    "policy": policy,
    "episode": episode,
    "state": one_state,
}
"""The function that does each kind of job of a run."""

DOERS_OF_NO_RUN: Mapping[str, Callable[[Database, JobClaim, Any], dict[str, Any]]] = {"pretrain": pretrain}
"""Those of jobs of no run, which take minutes: they tell of their progress under their claim."""


def do(db: Database, job: JobClaim) -> dict[str, Any]:
    """Do a job and return its result.

    Raises:
        LostClaimError: it was cancelled, or another worker has it.
        KeyError: the kind is of a newer version than this worker.
        ValidationError: the payload is not one of its kind.
    """
    if job.kind in OF_NO_RUN:
        return DOERS_OF_NO_RUN[job.kind](db, job, OF_NO_RUN[job.kind].model_validate(job.payload))
    return DOERS[job.kind](db, job.run_id, KINDS[job.kind].model_validate(job.payload))
