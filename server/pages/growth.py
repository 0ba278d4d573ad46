"""The growth of an agent as a part of the parent's page: the growth line, the lesson, the milestones."""

from __future__ import annotations

from typing import Any

from fastapi import Response

from parenting.server import runs
from parenting.server.admission import admitted_router
from parenting.server.api.names import RunId
from parenting.server.db import Database
from parenting.server.deps import Db
from parenting.server.pages.render import page
from parenting.server.reads.growth import growth_of, lesson_of, milestones_of
from parenting.server.tables import Run

router = admitted_router(include_in_schema=False)


@router.get("/runs/{run_id}/growth")
def growth_part(run_id: RunId, db: Db) -> Response:
    """For the script: the growth of a run as a part of a page."""
    return page("_growth.html", **growth_context(db, runs.get_run(db, run_id)))


def growth_context(db: Database, run: Run) -> dict[str, Any]:
    """Return the content of web/templates/_growth.html."""
    return {"growth": growth_of(db, run), "lesson": lesson_of(run), "milestones": milestones_of(run)}
