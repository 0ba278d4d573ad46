"""Watch it walk: an episode of the present policy, drawn on the board, with what it would do in every cell.

A worker plays it (`server.work.walk`). The script shows it over the parent's page; without JavaScript it is a
page of its own, which reloads until the walk is there.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from typing import Any

from fastapi import Request, Response

from parenting.drawing.sentences import mark
from parenting.drawing.walk_view import WalkView, walk_view
from parenting.server import jobs, runs
from parenting.server.admission import admitted_router
from parenting.server.api.names import PublicId, RunId
from parenting.server.columns import UNREADABLE
from parenting.server.db import Database
from parenting.server.deps import Db, notify_worker
from parenting.server.errors import DamagedRowError, NotFound
from parenting.server.job_kinds import WalkPayload
from parenting.server.pages.fields import ClientField
from parenting.server.pages.growth import growth_context
from parenting.server.pages.render import moved, page, redirect
from parenting.server.pages.texts import parent_title
from parenting.server.reads.jobs import JobSchema, job_schema
from parenting.server.statuses import JobState
from parenting.server.tables import Run

router = admitted_router(include_in_schema=False)

WALK_TEXTS = {
    "ready": mark("The agent gets ready."),
    "no_worker": mark(
        "No worker is running, so the agent cannot walk. It begins once one is started (parenting worker)."
    ),
}
"""The sentences until the walk is there; web/static/walk.js says the same."""


@dataclass(frozen=True)
class WalkPage:
    """The content of web/templates/walk.html."""

    run: Run
    title: str
    client: str  # who asked, and may ask again
    shown: WalkView | None
    facts: dict[str, Any]  # the tick, the stage and the number of answers of the policy that walked
    said: str  # a sentence while there is no walk
    refresh: bool


@router.post("/runs/{run_id}/walk")
def ask_walk(request: Request, run_id: RunId, db: Db, client_id: ClientField) -> Response:
    """For the form: ask for a walk with moves that were not drawn before, and go to its page."""
    run = runs.get_run(db, run_id)
    payload = WalkPayload(seed=secrets.randbelow(2**31))
    job = jobs.ask(db, run.id, "walk", payload.model_dump(), client_id)
    notify_worker(request)
    return redirect(f"/runs/{run.public_id}/walk/{job.public_id}")


@router.get("/runs/{run_id}/walk/{job_id}")
def walk_page(request: Request, run_id: RunId, job_id: PublicId, db: Db) -> Response:
    """The walk as a page of its own."""
    run = runs.get_run(db, run_id)
    if (way := moved(request, run)) is not None:
        return way
    job, client = _job(db, run, job_id)
    going_on = job.state in jobs.OPEN
    said = job.reason or WALK_TEXTS["no_worker" if job.worker == "silent" else "ready"]
    context = WalkPage(run, parent_title(run), client, _shown(job, run), job.result or {}, said, going_on)
    return page("walk.html", **vars(context), **growth_context(db, run))


@router.get("/runs/{run_id}/walk/{job_id}/board")
def walk_board(run_id: RunId, job_id: PublicId, db: Db) -> Response:
    """For the script: the same as a part of a page, once the walk is there."""
    run = runs.get_run(db, run_id)
    job, _ = _job(db, run, job_id)
    shown = _shown(job, run)
    if shown is None:
        raise NotFound(mark("This walk is not there yet, or has failed."))
    return page("_walk.html", shown=shown, facts=job.result)


def _job(db: Database, run: Run, job_id: str) -> tuple[JobSchema, str]:
    """Return a walk of this run, and who asked for it.

    Raises:
        NotFound: it is another run's, or of another kind.
    """
    job = jobs.get(db, job_id)
    if job.run_id != run.id or job.kind != "walk":
        raise NotFound(mark("There is no such walk of this run."))
    return job_schema(db, job), job.client_id


def _shown(job: JobSchema, run: Run) -> WalkView | None:
    """Return a walk that is done, as it is drawn.

    Raises:
        DamagedRowError: its result cannot be read.
    """
    if job.state is not JobState.DONE or job.result is None:
        return None
    found = job.result
    try:
        cells = {(one["cell"][0], one["cell"][1]): one["probabilities"] for one in found["cells"]}
        return walk_view(found["clip"], found["end"], found["unsafe"], cells, run.legend)
    except UNREADABLE as error:
        raise DamagedRowError(mark("The stored walk is damaged. Ask for another one.")) from error
