"""Routes of jobs: ask any worker for something that the web process cannot do, and look for the result."""

from __future__ import annotations

from typing import Annotated

from fastapi import Path, Request

from parenting.envs import registry
from parenting.server import jobs
from parenting.server.admission import admitted_router
from parenting.server.api.bodies import JobBody, PretrainBody
from parenting.server.api.names import PublicId, RunId
from parenting.server.api.responses import read_responses, write_responses
from parenting.server.deps import Db, notify_worker
from parenting.server.errors import InvalidFieldsError, NotFound
from parenting.server.reads.jobs import JobSchema, job_schema
from parenting.weights.estimate import MOST_SECONDS, seconds
from parenting.weights.store import Wanted

router = admitted_router(tags=["jobs"])

TOO_LARGE = (
    "Weights of this size are expected to take {expected} s, and a worker may take {most} s. Name a smaller"
    " size, or make them by parenting pretrain."
)

JobId = Annotated[PublicId, Path(description="The `id` of the job.", examples=["3sQv8hYJ2cT7mWk9xRzLpB"])]


@router.post(
    "/runs/{run_id}/jobs", summary="Ask for a job", status_code=202, responses=write_responses(404, 409)
)
def ask_job(request: Request, run_id: RunId, body: JobBody, db: Db) -> JobSchema:
    """Ask any worker for a job, such as a walk of the run's present policy. It changes nothing of the run.

    Look at the job until its state is *done* or *failed*; a worker that is there takes it within a second.
    A run has at most four open jobs: another one gets 409. A job that no worker has taken within a minute
    fails, and each is kept for ten minutes.
    """
    job = jobs.ask(db, run_id, body.kind, body.payload.model_dump(), body.client_id)
    notify_worker(request)
    return job_schema(db, job)


@router.post("/jobs", summary="Ask for weights", status_code=202, responses=write_responses(404, 409))
def ask_pretraining(request: Request, body: PretrainBody, db: Db) -> JobSchema:
    """Ask any worker to pre-train weights for a world and a size of levels, which new runs then begin with.

    It takes the worker a minute or more. Whoever asks for what is open or done gets the same job. An unknown
    world is 404, and a size whose weights are expected to take more than two hours is 422.
    """
    if body.payload.world not in registry.WORLDS:
        raise NotFound(f"There is no such world. There is: {', '.join(registry.WORLDS)}.")
    asked = body.payload
    expected = seconds(Wanted(registry.spec(asked.world), asked.height, asked.width))
    if expected > MOST_SECONDS:
        raise InvalidFieldsError([("payload", TOO_LARGE.format(expected=expected, most=MOST_SECONDS))])
    job = jobs.ask_of_no_run(db, body.kind, body.payload.model_dump(), body.client_id)
    notify_worker(request)
    return job_schema(db, job)


@router.get("/jobs/{job_id}", summary="Look at a job", responses=read_responses(404))
def get_job(job_id: JobId, db: Db) -> JobSchema:
    """Read a job, with its result once it is done."""
    return job_schema(db, jobs.get(db, job_id))


@router.post("/jobs/{job_id}/cancel", summary="Cancel a job", responses=write_responses(404, 409))
def cancel_job(job_id: JobId, db: Db) -> JobSchema:
    """Cancel a job that is not over: it fails, and its worker leaves it within a second or a step.

    Whoever else waits for the same weights is told so, and may ask for them again.
    """
    return job_schema(db, jobs.cancel(db, job_id))
