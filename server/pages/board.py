"""A clip as a drawing: tiles, pieces, trail and cues, in the units of one SVG (the parent's page).

Why the server draws and the script only animates: without JavaScript the server has to draw anyway. A second
drawing in JavaScript would be larger than the markup that it saves, and could come to look different.
Everything here only reads a stored clip and the run's legend: no world, no torch.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypedDict

from server.pages.trail import CELL, MOVES, Point, Trail, centre, trace

WALL, AGENT, BOX = "#", "A", "X"
DRAWN = frozenset(" WGTtOIBPS")  # the glyphs that have a pattern in web/templates/_tiles.html
DROWN, REACH = "W", "G"


class Frame(TypedDict):
    """One moment, as stored (server.tables.Query): the truth, what the agent saw, the pieces."""

    ground: list[str]
    observed: list[str]
    agent: list[int]
    box: list[int] | None


class Clip(TypedDict):
    """`length` actions between `length + 1` frames."""

    actions: list[str]
    length: int
    frames: list[Frame]


Cells = dict[str, str]
"""A path for every glyph, in the order in which they are painted."""


@dataclass(frozen=True)
class Layer:
    """What one frame shows that others do not: changed tiles, and what the agent wrongly believes to see."""

    tiles: Cells
    delusion: Cells


@dataclass(frozen=True)
class Piece:
    """The agent or the box: its centre in every frame."""

    at: tuple[Point, ...]
    trail: Trail

    @property
    def path(self) -> str:
        """The centres for the script: `x,y` of every frame."""
        return " ".join(f"{x},{y}" for x, y in self.at)


@dataclass(frozen=True)
class Board:
    """One clip, ready for web/templates/_board.html."""

    view: tuple[int, int, int, int]  # x, y, width, height
    tiles: Cells  # the same in every frame
    letters: tuple[tuple[Point, str], ...]  # glyphs that have no pattern
    layers: tuple[Layer, ...]  # one a frame
    agent: Piece
    box: Piece | None
    actions: tuple[str, ...]
    bumps: tuple[str, ...]  # for every step the direction that was blocked, or "-"
    cue: str  # how the clip ends: "drown", "reach" or ""

    @property
    def steps(self) -> int:
        """The clip's length: it may be shorter than T."""
        return len(self.actions)

    @property
    def deluded(self) -> bool:
        """Whether the agent sees, in any frame, what is not there."""
        return any(layer.delusion for layer in self.layers)


def draw(clip: Clip) -> Board:
    """A stored clip as a board. It may be shorter than T."""
    frames, actions = clip["frames"], tuple(clip["actions"])
    grounds = [frame["ground"] for frame in frames]
    agent = [_cell(frame["agent"]) for frame in frames]
    boxes = [_cell(frame["box"]) for frame in frames if frame["box"]]
    box = boxes if len(boxes) == len(frames) else None
    bumps = tuple(_blocked(step, action, grounds, agent, box) for step, action in enumerate(actions))
    steady, changing = _split(grounds)
    last = grounds[-1][agent[-1][0]][agent[-1][1]]
    return Board(
        view=_view(grounds),
        tiles=paths(grounds[0], steady),
        letters=_letters(grounds[0]),
        layers=tuple(
            Layer(paths(frame["ground"], changing), paths(frame["observed"], _wrong(frame)))
            for frame in frames
        ),
        agent=Piece(tuple(centre(cell) for cell in agent), trace(agent, bumps)),
        box=Piece(tuple(centre(cell) for cell in box), trace(box, ())) if box else None,
        actions=actions,
        bumps=bumps,
        cue="" if not actions or agent[-1] == agent[0] else {DROWN: "drown", REACH: "reach"}.get(last, ""),
    )


def paths(rows: Sequence[str], cells: Iterable[tuple[int, int]]) -> Cells:
    """One path for each glyph but the wall (the background). Cells side by side share a rectangle."""
    found: dict[str, list[str]] = {}
    run: tuple[int, int, int] | None = None  # row, first column, column after the last
    for row, column in [*sorted(cells), (-1, -1)]:
        if run and (row, column, _glyph(rows, row, column)) == (run[0], run[2], _glyph(rows, run[0], run[1])):
            run = (row, run[1], column + 1)
            continue
        if run and (glyph := _glyph(rows, run[0], run[1])) != WALL:
            width = (run[2] - run[1]) * CELL
            found.setdefault(glyph, []).append(f"M{run[1] * CELL} {run[0] * CELL}h{width}v{CELL}h-{width}z")
        run = (row, column, column + 1)
    return {glyph: "".join(parts) for glyph, parts in sorted(found.items())}


def _glyph(rows: Sequence[str], row: int, column: int) -> str:
    """The tile to paint; a glyph without a pattern is painted as land and gets its letter."""
    if row < 0:
        return ""
    glyph = rows[row][column]
    return glyph if glyph in DRAWN or glyph == WALL else " "


def _letters(rows: Sequence[str]) -> tuple[tuple[Point, str], ...]:
    return tuple(
        (centre((r, c)), glyph)
        for r, row in enumerate(rows)
        for c, glyph in enumerate(row)
        if glyph not in DRAWN and glyph not in (WALL, AGENT, BOX)
    )


def _view(grounds: Sequence[Sequence[str]]) -> tuple[int, int, int, int]:
    """All that is not wall in some frame, and half a cell of wall around it."""
    rows = [r for ground in grounds for r, line in enumerate(ground) if line.strip(WALL)]
    columns = [c for ground in grounds for line in ground for c, glyph in enumerate(line) if glyph != WALL]
    top, left = min(rows), min(columns)
    height, width = max(rows) - top + 1, max(columns) - left + 1
    half = CELL // 2
    return left * CELL - half, top * CELL - half, (width + 1) * CELL, (height + 1) * CELL


def _split(grounds: Sequence[Sequence[str]]) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """The cells that never change in the clip, and those that do."""
    steady: list[tuple[int, int]] = []
    changing: list[tuple[int, int]] = []
    for row, line in enumerate(grounds[0]):
        for column in range(len(line)):
            same = len({ground[row][column] for ground in grounds}) == 1
            (steady if same else changing).append((row, column))
    return steady, changing


def _cell(place: Sequence[int]) -> tuple[int, int]:
    return place[0], place[1]


def _wrong(frame: Frame) -> list[tuple[int, int]]:
    """The cells where the agent saw something that is not so; where a piece stands it saw the piece."""
    pieces = [_cell(place) for place in (frame["agent"], frame["box"]) if place]
    return [
        (row, column)
        for row, line in enumerate(frame["observed"])
        for column, glyph in enumerate(line)
        if glyph != frame["ground"][row][column] and (row, column) not in pieces
    ]


def _blocked(
    step: int,
    action: str,
    grounds: Sequence[Sequence[str]],
    agent: Sequence[tuple[int, int]],
    box: Sequence[tuple[int, int]] | None,
) -> str:
    """The direction in which this step ran into a wall, the edge or a stuck box; "-" otherwise."""
    if agent[step + 1] != agent[step]:
        return "-"
    row, column = (a + b for a, b in zip(agent[step], MOVES[action], strict=True))
    ground = grounds[step]
    inside = 0 <= row < len(ground) and 0 <= column < len(ground[0])
    solid = not inside or ground[row][column] in "#S" or (box is not None and box[step] == (row, column))
    return action if solid else "-"
