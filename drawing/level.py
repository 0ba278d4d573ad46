"""Draw a level as a picture of its own (SVG) in the tiles of the parent's page, in light and dark colours."""

from __future__ import annotations

import re

from parenting.drawing.board import Board, build_board
from parenting.drawing.clip import Clip, Frame
from parenting.drawing.render import standalone
from parenting.envs import registry
from parenting.envs.levels.spec import AGENT, BOX, LAND, PIECES, Level, WorldSpec


def draw_level(level: Level, spec: WorldSpec | None = None) -> str:
    """Return a level as the text of an SVG file. The same level gives the same text.

    Args:
        level: The level to draw, with its agent and box where an episode begins.
        spec: The level's world. By default it is the registered world of that name.

    Raises:
        UnknownWorldError: `spec` is missing and no world of this name is registered.
    """
    spec = spec or registry.spec(level.world, level)
    return standalone(
        "level.svg", board=level_board(level), legend=spec.legend, title=f"{spec.title}: {level.name}"
    )


def level_board(level: Level) -> Board:
    """Return a level as a clip of one frame, in which nothing has happened yet."""
    ground = [re.sub(f"[{PIECES}]", LAND, row) for row in level.rows]
    box = [list(cell) for cell in level.find(BOX)]
    (agent,) = level.find(AGENT)
    frame = Frame(ground=ground, observed=ground, agent=list(agent), box=box[0] if box else None)
    return build_board(Clip(actions=[], length=0, frames=[frame]))
