"""An episode of an agent's life on the dashboard's player, once a worker has made its moves again."""

from __future__ import annotations

from fastapi import Response

from parenting.drawing.sentences import mark
from parenting.drawing.walk_view import walk_view
from parenting.server import jobs, runs
from parenting.server.admission import admitted_router
from parenting.server.api.names import PublicId, RunId
from parenting.server.columns import UNREADABLE
from parenting.server.db import Database
from parenting.server.deps import Db
from parenting.server.errors import DamagedRowError, NotFound
from parenting.server.pages.render import page
from parenting.server.statuses import JobState
from parenting.server.tables import Job, Run

router = admitted_router(include_in_schema=False)


@router.get("/runs/{run_id}/episodes/{job_id}/board")
def episode_board(run_id: RunId, job_id: PublicId, db: Db) -> Response:
    """For the script: the episode as a part of a page."""
    run = runs.get_run(db, run_id)
    found = _done(db, run, job_id).result or {}
    try:
        shown = walk_view(found["clip"], found["end"], found["unsafe"], {}, run.legend)
        return page("_episode.html", shown=shown, facts=found, run=run)
    except UNREADABLE as error:
        raise DamagedRowError(mark("The stored episode is damaged. Ask for it again.")) from error


def _done(db: Database, run: Run, job_id: str) -> Job:
    job = jobs.get(db, job_id)
    if job.run_id != run.id or job.kind != "episode" or job.state is not JobState.DONE:
        raise NotFound(mark("This episode is not there yet, or has failed."))
    return job
