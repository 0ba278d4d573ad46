"""The trail of a piece: where its line and its arrow heads lie among the cells, whatever their sizes."""

from __future__ import annotations

import re
from itertools import pairwise

import pytest

from parenting.drawing.clip import MOVES
from parenting.drawing.trail import CELL, Trail, centre, trace

Cell = tuple[int, int]
Point = tuple[float, float]
Part = tuple[Point, Point]

DISC = 6.6
"""The radius of the agent's disc (drawing/templates/symbols.svg)."""

THERE_AND_BACK = [(1, 2), (1, 3), (1, 2)]


def lines(path: str) -> list[list[Point]]:
    """The points of each line of a path."""
    return [
        [(float(x), float(y)) for x, y in re.findall(r"(-?[\d.]+),(-?[\d.]+)", part)]
        for part in path.split("M")[1:]
    ]


def parts(trail: Trail) -> list[Part]:
    """Every straight part of the line."""
    return [part for line in lines(trail.line) for part in pairwise(line)]


def tips(trail: Trail) -> list[Point]:
    """Where the arrow heads point: a head's first corner."""
    return [head[0] for head in lines(trail.heads)]


def sizes(trail: Trail) -> list[float]:
    """The width of each head, across its way."""
    return [abs(b[0] - c[0]) + abs(b[1] - c[1]) for _, b, c in lines(trail.heads)]


def cell_of(point: Point) -> Cell:
    """The cell in which a point lies."""
    return int(point[1] // CELL), int(point[0] // CELL)


def moves(*actions: str, start: Cell = (5, 5)) -> list[Cell]:
    """The cells of a way."""
    way = [start]
    for action in actions:
        way.append((way[-1][0] + MOVES[action][0], way[-1][1] + MOVES[action][1]))
    return way


def distance(one: Point, other: Point) -> float:
    return max(abs(one[0] - other[0]), abs(one[1] - other[1]))


def meet(one: Part, other: Part) -> bool:
    """Return True if two parts, each along a row or a column, have a point in common."""
    spans = [[sorted((a[axis], b[axis])) for a, b in (one, other)] for axis in (0, 1)]
    return all(max(low for low, _ in span) <= min(high for _, high in span) for span in spans)


@pytest.mark.parametrize("action", MOVES)
def test_a_single_move_is_an_arrow_into_the_entered_cell(action: str) -> None:
    start, end = way = moves(action)
    trail = trace(way, ("-",))
    ((first, last),) = parts(trail)
    assert first == centre(start)
    assert cell_of(tips(trail)[0]) == end
    assert distance(last, centre(end)) < distance(first, centre(end))
    (head,) = lines(trail.heads)
    assert all(distance(corner, centre(start)) <= distance(head[0], centre(start)) for corner in head)


@pytest.mark.parametrize(
    ("there", "back"), [("right", "left"), ("left", "right"), ("up", "down"), ("down", "up")]
)
def test_lanes_there_and_back_do_not_meet(there: str, back: str) -> None:
    """Each keeps to the right of its direction, so neither hides the other."""
    trail = trace(moves(there, back, there), ("-",) * 3)
    along = [part for part in parts(trail) if max(distance(*part), 0) > CELL / 2]
    assert len(along) == 3
    assert not meet(along[0], along[1])
    assert not meet(along[1], along[2])
    for (begin, end), action in zip(along, (there, back, there), strict=True):
        dy, dx = MOVES[action]
        middle = centre((5, 5))
        aside = (begin[0] - middle[0]) * -dy + (begin[1] - middle[1]) * dx  # to the right of the direction
        assert aside > 0
        assert (end[0] - begin[0]) * dx + (end[1] - begin[1]) * dy > CELL / 2


def test_a_way_that_ends_where_it_began_points_at_the_piece_there() -> None:
    """The disc of the agent would hide an arrow that ends in the middle of its cell."""
    trail = trace(THERE_AND_BACK, ("-", "-"))
    home = centre(THERE_AND_BACK[0])
    end = tips(trail)[-1]
    assert DISC < ((end[0] - home[0]) ** 2 + (end[1] - home[1]) ** 2) ** 0.5 < CELL * 0.6


def test_a_step_that_is_repeated_keeps_further_to_the_right_in_a_finer_pen() -> None:
    """Left, right, left, right, left, right: three loops one in another."""
    trail = trace(moves(*("left", "right") * 3), ("-",) * 6)
    assert trail.fine
    rows = [begin[1] for begin, end in parts(trail) if begin[1] == end[1] and distance(begin, end) > CELL / 2]
    middle = centre((5, 5))[1]
    leftwards, rightwards = rows[::2], rows[1::2]
    assert leftwards == sorted(leftwards, reverse=True)
    assert rightwards == sorted(rightwards)
    assert max(leftwards) < middle < min(rightwards)
    assert len(set(rows)) == 6
    assert len(set(tips(trail))) == 6
    assert not trace(THERE_AND_BACK, ("-", "-")).fine


def test_a_fourth_loop_shares_the_outermost_lane_and_stays_in_its_cells() -> None:
    trail = trace(moves(*("left", "right") * 5), ("-",) * 10)
    assert {cell_of(point) for part in parts(trail) for point in part} <= {(5, 5), (5, 4)}


def test_the_last_step_that_moves_has_the_large_head() -> None:
    """A box stops before its clip ends."""
    stopped = trace([*moves("right", "right"), (5, 7), (5, 7)], ())
    assert sizes(stopped)[-1] > sizes(stopped)[0]
    assert cell_of(tips(stopped)[-1]) == (5, 7)


def test_after_a_bump_the_bump_is_the_end() -> None:
    bumped = trace([*moves("right", "right"), (5, 7)], ("-", "-", "right"))
    assert len(set(sizes(bumped))) == 1
    (bump,) = bumped.bumps
    assert bump.way == "right"
    assert bump.at == lines(bumped.line)[-1][-1]
    assert cell_of(bump.at) == (5, 7)
    assert bump.at[0] > centre((5, 7))[0]


@pytest.mark.parametrize("action", MOVES)
def test_a_bump_stands_before_the_edge_of_its_cell_turned_to_it(action: str) -> None:
    trail = trace([(5, 5), (5, 5)], (action,))
    (bump,) = trail.bumps
    dy, dx = MOVES[action]
    x, y = centre((5, 5))
    along = (bump.at[0] - x) * dx + (bump.at[1] - y) * dy
    assert CELL / 4 < along < CELL / 2
    assert not tips(trail)
    turned = re.search(r"rotate\((\d+)\)", bump.transform)
    degrees = {"right": 0, "down": 90, "left": 180, "up": 270}  # clockwise, since y grows downwards
    assert int(turned[1] if turned else 0) == degrees[action]


def test_a_bump_is_marked_once() -> None:
    assert len(trace([(5, 5)] * 4, ("up", "up", "up")).bumps) == 1


@pytest.mark.parametrize("first", MOVES)
@pytest.mark.parametrize("second", MOVES)
def test_a_trail_is_one_line_of_straight_parts_whichever_way_it_turns(first: str, second: str) -> None:
    trail = trace(moves(first, second), ("-", "-"))
    assert len(lines(trail.line)) == 1
    for begin, end in parts(trail):
        assert begin[0] == end[0] or begin[1] == end[1], "a part leads across"
    walked = {cell_of(point) for part in parts(trail) for point in part}
    assert walked <= set(moves(first, second))


def test_an_agent_that_stays_leaves_no_trail() -> None:
    assert trace([(5, 5), (5, 5)], ("-",)) == Trail("", "", (), fine=False)
