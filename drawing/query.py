"""Draw a query as a picture of its own (SVG): both boards with their arrows, and the words below them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from textwrap import wrap

from parenting.drawing.clip import Clip
from parenting.drawing.query_view import QueryView, SideView, query_view
from parenting.drawing.render import standalone
from parenting.envs import registry
from parenting.envs.levels.spec import Level, WorldSpec

PADDING, GAP, LINE = 24, 28, 22
"""Pixels around and between the boards, and from line to line of the words."""
BOARD, CELL = 400, 40
"""Pixels of the longer side of a board, and of the side of a cell, at most."""
LETTER = 7.7
"""Pixels that a letter of the words takes, on average."""


@dataclass(frozen=True)
class PlacedSide:
    """One board at its place in the picture, with the lines below it."""

    view: SideView
    x: int
    y: int
    scale: float  # of a board drawn at 9 pixels a unit
    lines: list[tuple[str, str, int]]  # text, tone, y


@dataclass(frozen=True)
class Layout:
    """The places of all parts of the picture, in pixels."""

    width: int
    height: int
    board_width: int
    board_height: int
    notes: list[tuple[str, int]]  # text, y
    sides: list[PlacedSide]


def draw_query(
    clips: Mapping[str, Clip], level: Level, kind: str, stage: int = 1, spec: WorldSpec | None = None
) -> str:
    """Return a query as the text of an SVG file, in light and dark colours, with its words.

    Args:
        clips: The clips by side, as `parenting.drawing.query_tensors.read_clips` returns them.
        level: The level on which they were recorded.
        kind: "guidance" (Sec. 2.1) or "preference" (Sec. 2.2).
        stage: The maturity T of the query. A clip of fewer steps has ended early.
        spec: The level's world. By default it is the registered world of that name.

    Raises:
        UnknownWorldError: `spec` is missing and no world of this name is registered.
    """
    spec = spec or registry.spec(level.world, level)
    view = query_view(clips, kind, stage, spec.legend, level.rows)
    return standalone("query.svg", legend=spec.legend, view=view, place=layout(view))


def layout(view: QueryView) -> Layout:
    """Place the boards side by side, and the words above and below them."""
    _, _, units_wide, units_high = view.sides[0].board.view
    scale = min(CELL / 20, BOARD / max(units_wide, units_high))
    wide, high = round(units_wide * scale), round(units_high * scale)
    width = 2 * (PADDING + wide) + GAP
    notes = _lines([(view.notes, "")], width - 2 * PADDING, 60)
    top = 60 + len(notes) * LINE + 24
    sides = [
        PlacedSide(side, x, top, scale / 9, _words(side, wide, top + high + LINE))
        for side, x in zip(view.sides, (PADDING, PADDING + wide + GAP), strict=True)
    ]
    bottom = max(side.lines[-1][2] for side in sides)
    return Layout(width, bottom + PADDING, wide, high, [(text, y) for text, _, y in notes], sides)


def _words(side: SideView, width: int, y: int) -> list[tuple[str, str, int]]:
    """Return the lines below a board: the actions of the clip, and its captions."""
    return _lines([(side.actions, ""), *side.captions], width, y)


def _lines(texts: Iterable[tuple[str, str]], width: int, y: int) -> list[tuple[str, str, int]]:
    """Break texts into lines that fit a width, one below the other from y on."""
    lines = [(line, tone) for text, tone in texts for line in wrap(text, int(width / LETTER))]
    return [(line, tone, y + LINE * number) for number, (line, tone) in enumerate(lines)]
