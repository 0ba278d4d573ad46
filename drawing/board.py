"""A clip as a drawing: tiles, pieces, trail and cues, in the units of one SVG (the parent's page).

Why the server draws and the script only animates: without JavaScript the server has to draw anyway. A second
drawing in JavaScript would be larger than the markup that it saves, and could come to look different.
Everything here only reads a stored clip and the run's legend: no world, no torch.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from parenting.drawing.clip import (
    AGENT,
    BARS,
    BOX,
    LAND,
    WALL,
    Cell,
    Clip,
    Frame,
    ahead,
    cell,
    tile_at,
    tile_under_agent,
)
from parenting.drawing.cues import Cue, find_cues
from parenting.drawing.trail import CELL, Point, Trail, centre, trace

CORNER = 8.0
"""The side of a tile that is drawn small in the corner of a cell."""
PATTERNED = frozenset(" WGTtOIBPS")  # the glyphs that have a pattern in drawing/templates/tiles.svg


Cells = dict[str, str]
"""A path for every glyph, in the order in which they are painted."""


@dataclass(frozen=True)
class Delusion:
    """Tiles that the agent wrongly believes to see while it stands at one place."""

    cells: Cells
    at: Point
    first: int  # frame
    last: int

    @property
    def glyph(self) -> str:
        """The tile that it believes in, for the bubble of thought."""
        return next(iter(self.cells))


class Stand(NamedTuple):
    """A tile that the agent stands on and hides: it is drawn small in a corner of the cell."""

    glyph: str
    at: Point  # its upper left corner
    first: int  # frame
    last: int


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
    """One clip, ready for drawing/templates/board.svg."""

    view: tuple[int, int, int, int]  # x, y, width, height
    tiles: Cells  # the same in every frame
    unwatched: str  # a path: where the supervisor's bars would stand
    letters: tuple[tuple[Point, str], ...]  # glyphs that have no pattern
    layers: tuple[Cells, ...]  # the tiles that change, one a frame
    delusions: tuple[Delusion, ...]
    stands: tuple[Stand, ...]  # the tiles that the agent hides
    agent: Piece
    box: Piece | None
    actions: tuple[str, ...]
    bumps: tuple[str, ...]  # for every step the direction that was blocked, or "-"
    cues: tuple[Cue, ...]  # all that happens, in its order
    start: Point | None = None  # the upper left corner of the cell where episodes begin

    @property
    def steps(self) -> int:
        """The clip's length: it may be shorter than T."""
        return len(self.actions)

    @property
    def marks(self) -> list[tuple[Cue, Point]]:
        """The cues to draw, each at its centre: what happens twice at a cell is drawn once."""
        first: dict[tuple[str, Cell], Cue] = {}
        for cue in self.cues:
            first.setdefault((cue.name, cue.cell), cue)
        return [(cue, centre(cue.cell)) for cue in first.values()]


def build_board(clip: Clip, stage: int = 1, bars: Sequence[Cell] = (), start: Cell | None = None) -> Board:
    """Return a stored clip as a board.

    Args:
        clip: The clip; it may be shorter than its `stage`.
        stage: The maturity T.
        bars: The places of the supervisor's bars in the level.
        start: The cell where the level's episodes begin, to mark it.
    """
    frames, actions = clip["frames"], tuple(clip["actions"])
    grounds = [frame["ground"] for frame in frames]
    agent = [cell(frame["agent"]) for frame in frames]
    boxes = [cell(frame["box"]) for frame in frames if frame["box"]]
    box = boxes if len(boxes) == len(frames) else None
    bumps = tuple(_blocked(frames[step], frames[step + 1], action) for step, action in enumerate(actions))
    gone = [bar for bar in bars if tile_at(grounds[0], bar) == LAND]
    steady, changing = _split(grounds)
    return Board(
        view=_view(grounds),
        tiles=tile_paths(grounds[0], set(steady) - set(gone)),
        unwatched=tile_paths(grounds[0], gone).get(LAND, ""),
        letters=_letters(grounds[0]),
        layers=tuple(tile_paths(ground, changing) for ground in grounds),
        delusions=tuple(_delusions(frames)),
        stands=tuple(_stands(frames)),
        agent=Piece(tuple(map(centre, agent)), trace(agent, bumps)),
        box=Piece(tuple(map(centre, box)), trace(box, ())) if box else None,
        actions=actions,
        bumps=bumps,
        cues=find_cues(clip, stage),
        start=None if start is None else (start[1] * CELL, start[0] * CELL),
    )


def tile_paths(rows: Sequence[str], cells: Iterable[Cell]) -> Cells:
    """One path for each glyph but the wall (the background). Cells side by side share a rectangle."""
    found: dict[str, list[str]] = {}
    run: tuple[int, int, int] | None = None  # row, first column, column after the last
    for row, column in [*sorted(cells), (-1, -1)]:
        if run and (row, column, _glyph(rows, row, column)) == (run[0], run[2], _glyph(rows, run[0], run[1])):
            run = (row, run[1], column + 1)
            continue
        if run and (tile := _glyph(rows, run[0], run[1])) != WALL:
            width = (run[2] - run[1]) * CELL
            found.setdefault(tile, []).append(f"M{run[1] * CELL} {run[0] * CELL}h{width}v{CELL}h-{width}z")
        run = (row, column, column + 1)
    return {tile: "".join(parts) for tile, parts in sorted(found.items())}


def _glyph(rows: Sequence[str], row: int, column: int) -> str:
    """The tile to paint; a glyph without a pattern is painted as land and gets its letter."""
    if row < 0:
        return ""
    tile = rows[row][column]
    return tile if tile in PATTERNED or tile == WALL else LAND


def _letters(rows: Sequence[str]) -> tuple[tuple[Point, str], ...]:
    return tuple(
        (centre((r, c)), tile)
        for r, row in enumerate(rows)
        for c, tile in enumerate(row)
        if tile not in PATTERNED and tile not in (WALL, AGENT, BOX)
    )


def _view(grounds: Sequence[Sequence[str]]) -> tuple[int, int, int, int]:
    """All that is not wall in some frame, and half a cell of wall around it."""
    rows = [r for ground in grounds for r, line in enumerate(ground) if line.strip(WALL)]
    columns = [c for ground in grounds for line in ground for c, tile in enumerate(line) if tile != WALL]
    top, left = min(rows), min(columns)
    height, width = max(rows) - top + 1, max(columns) - left + 1
    half = CELL // 2
    return left * CELL - half, top * CELL - half, (width + 1) * CELL, (height + 1) * CELL


def _split(grounds: Sequence[Sequence[str]]) -> tuple[list[Cell], list[Cell]]:
    """The cells that never change in the clip, and those that do."""
    steady: list[Cell] = []
    changing: list[Cell] = []
    for row, line in enumerate(grounds[0]):
        for column in range(len(line)):
            same = len({ground[row][column] for ground in grounds}) == 1
            (steady if same else changing).append((row, column))
    return steady, changing


def _delusions(frames: Sequence[Frame]) -> list[Delusion]:
    """Find where the agent sees what is not so; frames with the same delusion share one drawing."""
    found: list[Delusion] = []
    for number, frame in enumerate(frames):
        now = Delusion(
            tile_paths(frame["observed"], _wrong(frame)), centre(cell(frame["agent"])), number, number
        )
        if found and replace(now, first=found[-1].first, last=number - 1) == found[-1]:
            found[-1] = replace(found[-1], last=number)
        elif now.cells:
            found.append(now)
    return found


def _stands(frames: Sequence[Frame]) -> list[Stand]:
    """Find the tiles that the agent hides; frames in which it stays on one share a drawing.

    Land looks the same everywhere, and in the water the agent is not drawn.
    """
    found: list[Stand] = []
    for number, frame in enumerate(frames):
        tile, (x, y) = tile_under_agent(frame), centre(cell(frame["agent"]))
        now = Stand(tile, (x - CELL / 2, y + CELL / 2 - CORNER), number, number)
        if found and (found[-1].glyph, found[-1].at, found[-1].last) == (tile, now.at, number - 1):
            found[-1] = found[-1]._replace(last=number)
        elif tile in PATTERNED and tile not in (LAND, "W"):
            found.append(now)
    return found


def _wrong(frame: Frame) -> list[Cell]:
    """The cells where the agent saw something that is not so; where a piece stands it saw the piece."""
    pieces = [cell(place) for place in (frame["agent"], frame["box"]) if place]
    return [
        (row, column)
        for row, line in enumerate(frame["observed"])
        for column, tile in enumerate(line)
        if tile != frame["ground"][row][column] and (row, column) not in pieces
    ]


def _blocked(before: Frame, after: Frame, action: str) -> str:
    """The direction in which this step ran into a wall, the edge or a stuck box; "-" otherwise."""
    if before["agent"] != after["agent"]:
        return "-"
    place = ahead(before["agent"], action)
    in_the_way = before["box"] is not None and cell(before["box"]) == place
    return action if in_the_way or tile_at(before["ground"], place) in WALL + BARS else "-"
