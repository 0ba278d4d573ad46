"""The trail of a piece through a clip, drawn on the board: a line with an arrow head for every step."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from parenting.drawing.clip import MOVES, Cell
from parenting.drawing.symbols import TURNS

CELL = 20
"""The side of a cell in the units of the drawing."""
LANE, LANES = 2.5, 3
"""Every step keeps to the right of its direction, so that a way there and back shows as two lines. A step
that repeats an earlier one keeps further to the right, up to the last of the lanes."""
SMALL, FINE, LAST = 3.2, 2.3, 4.2
"""The sizes of the arrow heads on the way, of those of a fine trail, and of the last one."""
TIP = 1.05
"""The point of the last head, in steps from the start of its step."""
HOME = 0.69
"""The same if the trail ends where it began: the piece is drawn there, so the head is a fine one."""
HEADS = (0.76, 0.88, 1.0)
"""The points of the other heads, by lane: heads side by side would be a blot. Every head lies inside the cell
that its step enters."""

Point = tuple[float, float]
Part = tuple[Point, Point]


@dataclass(frozen=True)
class Bump:
    """A step that was blocked: where the way ends, and in which direction it went."""

    at: Point
    way: str

    @property
    def transform(self) -> str:
        """The place and the turn of its symbol, as an SVG transform."""
        x, y = self.at
        return f"translate({x:g} {y:g})" + (f" rotate({TURNS[self.way]})" if TURNS[self.way] else "")


@dataclass(frozen=True)
class Trail:
    """The trail of a piece. The line and its arrow heads are SVG path data."""

    line: str
    heads: str
    bumps: tuple[Bump, ...]
    fine: bool  # drawn with a finer pen, since a step is repeated


def centre(cell: Cell) -> Point:
    """The middle of (row, column) as (x, y)."""
    return cell[1] * CELL + CELL // 2, cell[0] * CELL + CELL // 2


def trace(cells: Sequence[Cell], bumps: Sequence[str]) -> Trail:
    """Draw the trail through `cells`, one per frame; `bumps` names the blocked direction of each step."""
    parts: list[Part] = []
    heads: list[str] = []
    met: dict[Bump, None] = {}
    stops: list[bool] = []
    passed: Counter[tuple[Cell, Cell]] = Counter()
    last, fine = _last(cells, bumps), _repeats(cells)
    for step, (here, there) in enumerate(pairwise(cells)):
        blocked = bumps[step] if step < len(bumps) else "-"
        if here != there:
            lane = min(passed[here, there], LANES - 1) if len(cells) > 2 else -1
            passed[here, there] += 1
            start, end = _lane(here, there, LANE * (lane + 1))
            at, size = (HEADS[lane], FINE if fine else SMALL)
            if step == last:
                at, size = (HOME, FINE) if there == cells[0] else (TIP, LAST - fine)
            parts.append((start, _along(start, end, at - size / CELL) if step == last else end))
            heads.append(_head(start, end, at, size))
        elif blocked != "-":
            parts.append(_towards(here, MOVES[blocked], LANE if len(cells) > 2 else 0.0))
            met[Bump(parts[-1][1], blocked)] = None
        else:
            continue
        stops.append(here == there)
    return Trail(_line(parts, stops), "".join(heads), tuple(met), fine)


def _repeats(cells: Sequence[Cell]) -> bool:
    """Return True if a step leads from the same cell to the same cell as an earlier one."""
    moves = [step for step in pairwise(cells) if step[0] != step[1]]
    return len(set(moves)) < len(moves)


def _last(cells: Sequence[Cell], bumps: Sequence[str]) -> int:
    """The step that ends the trail with a large head: the last that moves, unless a bump comes after it."""
    moving = [step for step, (here, there) in enumerate(pairwise(cells)) if here != there]
    if not moving or any(blocked != "-" for blocked in bumps[moving[-1] + 1 :]):
        return -1
    return moving[-1]


def _lane(here: Cell, there: Cell, lane: float) -> Part:
    (x0, y0), (x1, y1) = centre(here), centre(there)
    dx, dy = (x1 - x0) / CELL, (y1 - y0) / CELL
    return (x0 - dy * lane, y0 + dx * lane), (x1 - dy * lane, y1 + dx * lane)


def _towards(cell: Cell, move: Cell, lane: float) -> Part:
    """From the middle of the cell to just before its edge."""
    (x, y), (dy, dx) = centre(cell), move
    reach = CELL / 2 - 1
    start = x - dy * lane, y + dx * lane
    return start, (start[0] + dx * reach, start[1] + dy * reach)


def _along(start: Point, end: Point, part: float) -> Point:
    """The point after a part of the way."""
    return start[0] + (end[0] - start[0]) * part, start[1] + (end[1] - start[1]) * part


def _head(start: Point, end: Point, at: float, size: float) -> str:
    """A triangle that points along the step, with its tip after a part of the way."""
    dx, dy = (end[0] - start[0]) / CELL, (end[1] - start[1]) / CELL
    x, y = _along(start, end, at)
    back, side = size * 1.5, size
    corners = [(x, y), (x - dx * back - dy * side, y - dy * back + dx * side)]
    corners.append((x - dx * back + dy * side, y - dy * back - dx * side))
    return "M" + "L".join(_point(corner) for corner in corners) + "z"


def _line(parts: Sequence[Part], stops: Sequence[bool]) -> str:
    """Join the steps, also where the way turns or turns back. A new line begins after a bump."""
    lines: list[list[Point]] = []
    for place, (start, end) in enumerate(parts):
        if not lines or stops[place - 1]:
            lines.append([])
        points = lines[-1]
        if len(points) > 1:
            points[-1:] = _joint(points[-2], points[-1], start, end)
        else:
            points.append(start)
        points.append(end)
    return "".join("M" + "L".join(_point(point) for point in points) for points in lines)


def _joint(before: Point, corner: Point, start: Point, end: Point) -> list[Point]:
    """Return the points between two steps: the corner of their lanes, or a way round where one leads back."""
    (ax, ay), (bx, by) = _way(before, corner), _way(start, end)
    if ax * bx + ay * by == 0:
        return [(start[0], corner[1]) if ay == 0 else (corner[0], start[1])]
    if (ax, ay) == (bx, by):
        return [corner] if corner == start else [corner, start]
    out = (abs(start[0] - corner[0]) + abs(start[1] - corner[1])) / 2 - LANE  # outer lanes turn further out
    return [(corner[0] + ax * out, corner[1] + ay * out), (start[0] + ax * out, start[1] + ay * out)]


def _way(start: Point, end: Point) -> tuple[int, int]:
    """The direction of a step: right (1, 0), left (-1, 0), down (0, 1) or up (0, -1)."""
    dx, dy = round(end[0] - start[0], 6), round(end[1] - start[1], 6)
    return (dx > 0) - (dx < 0), (dy > 0) - (dy < 0)


def _point(point: Point) -> str:
    return ",".join(f"{round(value, 2):g}" for value in point)
