"""The trail of a piece through a clip, drawn on the board: a line with an arrow head for every step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

CELL = 20
"""The side of a cell in the units of the drawing."""
LANE = 2.5
"""Every step keeps to the right of its direction, so that a way there and back shows as two lines."""
TIP, LAST = 1.05, 4.2
"""Where the last arrow head points, in steps, and its size."""
MOVES = {"up": (-1, 0), "down": (1, 0), "left": (0, -1), "right": (0, 1)}

Point = tuple[float, float]


@dataclass(frozen=True)
class Trail:
    """SVG path data: the line, its arrow heads, and the mark of every bump."""

    line: str
    heads: str
    bumps: str


def centre(cell: tuple[int, int]) -> Point:
    """The middle of (row, column) as (x, y)."""
    return cell[1] * CELL + CELL // 2, cell[0] * CELL + CELL // 2


def trace(cells: Sequence[tuple[int, int]], bumps: Sequence[str]) -> Trail:
    """The trail through `cells`, one a frame; `bumps` names for every step the direction that was blocked."""
    lane = LANE if len(cells) > 2 else 0.0
    parts: list[tuple[Point, Point]] = []
    heads: list[str] = []
    marks: list[str] = []
    stops: list[bool] = []
    for step, (here, there) in enumerate(pairwise(cells)):
        blocked = bumps[step] if step < len(bumps) else "-"
        last = step == len(cells) - 2
        if here != there:
            stops.append(False)
            start, end = _lane(here, there, lane)
            parts.append((start, _short_of(start, end) if last else end))
            heads.append(_head(start, end, last))
        elif blocked != "-":
            stops.append(True)
            parts.append(_towards(here, MOVES[blocked], lane))
            marks.append(_mark(parts[-1][1], MOVES[blocked]))
    return Trail(_line(parts, stops), "".join(heads), "".join(marks))


def _lane(here: tuple[int, int], there: tuple[int, int], lane: float) -> tuple[Point, Point]:
    (x0, y0), (x1, y1) = centre(here), centre(there)
    dx, dy = (x1 - x0) / CELL, (y1 - y0) / CELL
    return (x0 - dy * lane, y0 + dx * lane), (x1 - dy * lane, y1 + dx * lane)


def _towards(cell: tuple[int, int], move: tuple[int, int], lane: float) -> tuple[Point, Point]:
    """From the middle of the cell to just before its edge."""
    (x, y), (dy, dx) = centre(cell), move
    reach = CELL / 2 - 1
    start = x - dy * lane, y + dx * lane
    return start, (start[0] + dx * reach, start[1] + dy * reach)


def _short_of(start: Point, end: Point) -> Point:
    """Where the trail ends, so that it does not stick out of the last arrow head."""
    part = TIP - LAST / CELL
    return start[0] + (end[0] - start[0]) * part, start[1] + (end[1] - start[1]) * part


def _head(start: Point, end: Point, last: bool) -> str:
    """A triangle that points along the step: past its middle, and larger at the end of the last one."""
    dx, dy = (end[0] - start[0]) / CELL, (end[1] - start[1]) / CELL
    at, size = (TIP, LAST) if last else (0.68, 3.2)
    x, y = start[0] + dx * CELL * at, start[1] + dy * CELL * at
    back, side = size * 1.5, size
    corners = [(x, y), (x - dx * back - dy * side, y - dy * back + dx * side)]
    corners.append((x - dx * back + dy * side, y - dy * back - dx * side))
    return "M" + "L".join(_point(corner) for corner in corners) + "z"


def _mark(wall: Point, move: tuple[int, int]) -> str:
    """A bar across the way and two sparks: here it went no further."""
    (x, y), (dy, dx) = wall, move
    bar = f"M{_point((x - dy * 5, y - dx * 5))}L{_point((x + dy * 5, y + dx * 5))}"
    sparks = "".join(
        f"M{_point((x + dx * 2.5 + s * dy * 3, y + dy * 2.5 + s * dx * 3))}"
        f"L{_point((x + dx * 5.5 + s * dy * 5.5, y + dy * 5.5 + s * dx * 5.5))}"
        for s in (-1, 1)
    )
    return bar + sparks


def _line(parts: Sequence[tuple[Point, Point]], bumps: Sequence[bool]) -> str:
    """The steps joined: where the way turns, at the corner of the two lanes. After a bump it begins anew."""
    lines: list[list[Point]] = []
    for place, (start, end) in enumerate(parts):
        if not lines or bumps[place - 1]:
            lines.append([])
        points = lines[-1]
        if len(points) > 1 and _turns(points[-2], points[-1], start, end):
            corner = (start[0], points[-1][1]) if start[0] == end[0] else (points[-1][0], start[1])
            points[-1] = corner
        else:
            points.append(start)
        points.append(end)
    return "".join("M" + "L".join(_point(point) for point in points) for points in lines)


def _turns(before: Point, corner: Point, start: Point, end: Point) -> bool:
    """Whether two steps meet at a right angle."""
    first = (corner[0] - before[0], corner[1] - before[1])
    second = (end[0] - start[0], end[1] - start[1])
    near = abs(start[0] - corner[0]) + abs(start[1] - corner[1]) <= 4 * LANE
    return near and first[0] * second[0] + first[1] * second[1] == 0


def _point(point: Point) -> str:
    return ",".join(f"{round(value, 2):g}" for value in point)
