"""Draw the tiles and pieces of all worlds with their names, as one picture (SVG) for the guide of parents."""

from __future__ import annotations

from typing import NamedTuple

from parenting.drawing.render import standalone
from parenting.envs.levels.spec import AGENT
from parenting.envs.registry import BUILT_IN

COLUMNS = 4
WIDE, HIGH, MARGIN = 176, 56, 20
"""Pixels of a place in the picture, and around all places."""


class Sign(NamedTuple):
    """A tile or a piece, its name, and its place in the picture."""

    glyph: str
    name: str
    x: int
    y: int


def draw_signs() -> str:
    """Return the picture as the text of an SVG file, in light and dark colours."""
    legend = {glyph: name for world in BUILT_IN.values() for glyph, name in world.legend.items()}
    glyphs = [AGENT, *(glyph for glyph in legend if glyph != AGENT)]
    signs = [
        Sign(glyph, legend[glyph], MARGIN + number % COLUMNS * WIDE, MARGIN + number // COLUMNS * HIGH)
        for number, glyph in enumerate(glyphs)
    ]
    rows = -(-len(signs) // COLUMNS)
    width, height = 2 * MARGIN + COLUMNS * WIDE, 2 * MARGIN + rows * HIGH - HIGH // 4
    return standalone("signs.svg", legend=legend, signs=signs, width=width, height=height)
