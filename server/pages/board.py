"""The board of a run on its dashboard: the level as it is drawn elsewhere, over which the script paints.

What is painted was stored by the worker; the script reads it from the API. No page computes a policy.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from parenting.drawing.board import Board, build_board
from parenting.drawing.clip import AGENT, BOX, LAND, Clip, Frame, find_tile
from parenting.server.tables import Run

LAYERS = (
    ("", "None"),
    ("familiarity", "Familiarity f"),
    ("ask", "Chance to ask, p_guid ** f"),
    ("visits", "Visits"),
    ("deaths", "Unsafe moves"),
    ("entries", "Entries of X"),
)
"""The layers of which one is shaded, by the names of the API."""
NUMBERS = (("up", "Up"), ("down", "Down"), ("left", "Left"), ("right", "Right"), *LAYERS[1:])
"""The numbers of a cell."""
NOTHING = "Nothing is stored yet: a worker stores what is seen here as the agent lives."


@dataclass(frozen=True)
class BoardPanel:
    """The content of web/templates/_board.html."""

    drawn: Board
    layers: Sequence[tuple[str, str]] = LAYERS
    numbers: Sequence[tuple[str, str]] = field(default=NUMBERS)
    said: str = NOTHING


def board_panel(run: Run) -> BoardPanel:
    """Return the panel of a run with its level as an episode begins."""
    return BoardPanel(build_board(Clip(actions=[], length=0, frames=[begin(run)])))


def begin(run: Run) -> Frame:
    """Return the frame of a run's level in which an episode begins, from the text of the level."""
    rows = run.level_text.rpartition("\n\n")[2].splitlines()
    ground = [re.sub(f"[{AGENT}{BOX}]", LAND, row) for row in rows]
    (agent, *_), box = find_tile(rows, AGENT), find_tile(rows, BOX)
    return Frame(ground=ground, observed=rows, agent=list(agent), box=list(box[0]) if box else None)
