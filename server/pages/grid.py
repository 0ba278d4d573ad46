"""The board of a question as a grid of cells, for the script that explores it by arrow keys."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query, Response

from parenting.drawing.grid import GridView, grid_view
from parenting.drawing.sentences import tr
from parenting.envs import registry
from parenting.server import runs
from parenting.server.admission import admitted_router
from parenting.server.api.names import RunId
from parenting.server.damage import reading
from parenting.server.deps import Db
from parenting.server.pages.lessons import LESSONS, WORLD
from parenting.server.pages.parent import question_of
from parenting.server.pages.question import side_names
from parenting.server.pages.render import page
from parenting.server.public_ids import LENGTH

router = admitted_router(include_in_schema=False)

LONGEST = 1000
"""Steps of a clip at most."""


Step = Annotated[int, Query(ge=0, le=LONGEST)]


@router.get("/runs/{run_id}/parent/grid")
def grid(run_id: RunId, db: Db, query: Annotated[str, Query(max_length=LENGTH)], step: Step = 0) -> Response:
    """The cells of a question's board at a step of its clips, as markup."""
    run = runs.get_run(db, run_id)
    asked = question_of(db, run, query)
    with reading(asked):
        return _shown(grid_view(asked.clips, run.legend, side_names(asked, run), step))


@router.get("/practice/grid")
def practice_grid(at: Annotated[int, Query(ge=1, le=len(LESSONS))], step: Step = 0) -> Response:
    """The same of a question of the practice."""
    lesson = LESSONS[at - 1]
    names = ("A", "B") if lesson.kind == "guidance" else ("left", "right")
    return _shown(grid_view(lesson.clips, registry.spec(WORLD).legend, names, step))


def _shown(found: GridView) -> Response:
    return page("_grid.html", grid=found, label=_label(found))


def _label(found: GridView) -> str:
    if found.steps == 1:
        return tr("The board")
    return tr("The board at step {step} of {steps}", step=found.step, steps=found.steps)
