"""The board of a run on its dashboard: the level as it is drawn elsewhere, over which the script paints.

What is painted was stored by the worker; the script reads it from the API. No page computes a policy.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from fastapi import Response

from parenting.drawing.board import Board, build_board
from parenting.drawing.clip import AGENT, BOX, LAND, Clip, Frame, find_tile
from parenting.drawing.rests import complete
from parenting.drawing.sentences import mark
from parenting.server import runs
from parenting.server.admission import admitted_router
from parenting.server.api.names import RunId
from parenting.server.board import store
from parenting.server.db import Database
from parenting.server.deps import Db
from parenting.server.errors import NotFound
from parenting.server.pages.render import page
from parenting.server.tables import Run

router = admitted_router(include_in_schema=False)

LAYERS = (
    ("", "None"),
    ("familiarity", "Familiarity f"),
    ("ask", "Chance to ask, p_guid ** f"),
    ("visits", "Visits"),
    ("deaths", "Unsafe moves"),
    ("entries", "Entries of X"),
)
"""The layers of which one is shaded, by the names of the API."""
WAYS = (("up", "Up"), ("down", "Down"), ("left", "Left"), ("right", "Right"))
NOTHING = "Nothing is stored yet: a worker stores what is seen here as the agent lives."


@dataclass(frozen=True)
class BoardPanel:
    """The content of web/templates/_board.html."""

    drawn: Board
    layers: Sequence[tuple[str, str]]
    numbers: Sequence[tuple[str, str]]
    pickers: int  # of the rest of the state, for which the page keeps room
    said: str = NOTHING


@router.get("/runs/{run_id}/board/{rest}")
def rest_board(run_id: RunId, rest: int, db: Db) -> Response:
    """For the script: the board with another rest of the state than at the beginning."""
    run = runs.get_run(db, run_id)
    stored = store.read_states(db, run.id)
    if stored is None or not 0 <= rest < len(stored[0]["rests"]):
        raise NotFound(mark("No such board is stored of this run."))
    found = stored[0]["rests"][rest]
    frame = Frame(
        ground=found["ground"], observed=found["ground"], agent=begin(run)["agent"], box=found["box"]
    )
    return page("_rest.html", drawn=_drawn(frame))


def board_panel(db: Database, run: Run, harm: str) -> BoardPanel:
    """Return the panel of a run with its level as an episode begins; `harm` names its unsafe moves."""
    layers = [(name, harm if name == "deaths" else text) for name, text in LAYERS]
    stored = store.read_states(db, run.id)
    words = complete([rest["parts"] for rest in stored[0]["rests"]]) if stored else []
    varying = {name for one in words for name, word in one.items() if word != words[0][name]}
    return BoardPanel(_drawn(begin(run)), layers, [*WAYS, *layers[1:]], min(3, len(varying)))


def begin(run: Run) -> Frame:
    """Return the frame of a run's level in which an episode begins, from the text of the level."""
    rows = run.level_text.rpartition("\n\n")[2].splitlines()
    ground = [re.sub(f"[{AGENT}{BOX}]", LAND, row) for row in rows]
    (agent, *_), box = find_tile(rows, AGENT), find_tile(rows, BOX)
    return Frame(ground=ground, observed=rows, agent=list(agent), box=list(box[0]) if box else None)


def _drawn(frame: Frame) -> Board:
    return build_board(Clip(actions=[], length=0, frames=[frame]))
