"""Tell in words where everything lies from the agent: enough to answer a question without its boards.

A place is told from where both clips begin, as "2 up and 1 left". "By air" counts rows and columns and looks
through walls. Ways are told only if they are asked for, since their length gives the answer away. All is read
from stored clips and the legend of the run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from parenting.drawing.clip import (
    LAND,
    MOVES,
    WALL,
    Cell,
    Clip,
    Frame,
    ahead,
    cell,
    find_tile,
    tile_at,
    tile_under_agent,
)
from parenting.drawing.cues import DRY, GOAL
from parenting.drawing.places import place, places
from parenting.drawing.safe_ways import safe_steps

TOLD_APART = WALL + LAND
"""Glyphs that are not told tile by tile: walls come last, and what is not told is land."""
FIRST = "WOBP"
"""Glyphs that are told first after the goal: a step alone is dangerous there (docs/paper.md, "Unsafe")."""


def surroundings(
    clips: Mapping[str, Clip],
    legend: Mapping[str, str],
    names: tuple[str, str] = ("left", "right"),
    guide: bool = False,
) -> tuple[str, ...]:
    """Return the sentences: the difference of the two clips first, then the board from the agent's place.

    Args:
        clips: The clips by side, "left" and "right"; both begin in the same state.
        legend: The name of each tile of the world, by glyph.
        names: The names of the two clips.
        guide: True to tell how many steps a safe way to the goal has after each clip.
    """
    sides = list(zip(names, (clips["left"], clips["right"]), strict=True))
    start = clips["left"]["frames"][0]
    aim = GOAL if GOAL in legend else DRY
    found = [*_difference(sides, aim, legend)]
    if guide and aim in legend:
        found.append(_ways(sides, aim))
    longest = max(clip["length"] for _, clip in sides)
    for name, clip in sides:
        found += _end(name.capitalize(), clip, longest, legend)
    return (*found, *_board(start, legend))


def _difference(sides: Sequence[tuple[str, Clip]], aim: str, legend: Mapping[str, str]) -> Iterator[str]:
    """Yield how far the goal is after each clip, or in a world without one the nearest dry plant."""
    (one, first), (other, second) = ((name, clip["frames"][-1]) for name, clip in sides)
    if first == second:
        yield "Both end alike."
    if aim not in legend:
        return
    what = "the goal" if aim == GOAL else f"the nearest {legend[aim]}"
    near, far = _nearest(first, aim), _nearest(second, aim)
    if near is not None and far is not None:
        yield f"By air {what} is {_cells(near)} away after {one}, and {_cells(far)} after {other}."


def _ways(sides: Sequence[tuple[str, Clip]], aim: str) -> str:
    told = [
        f"{'none' if steps is None else _count(steps, 'step')} after {name}"
        for name, steps in ((name, safe_steps(clip["frames"][-1], aim)) for name, clip in sides)
    ]
    return f"By a safe way: {', '.join(told)}."


def _end(name: str, clip: Clip, longest: int, legend: Mapping[str, str]) -> Iterator[str]:
    """Yield where a clip ends, what it meets on its way, and what is not as it was."""
    first, last = clip["frames"][0], clip["frames"][-1]
    start, tile = cell(first["agent"]), tile_under_agent(last)
    where = "where it begins" if first["agent"] == last["agent"] else place(start, cell(last["agent"]))
    on = "" if tile == LAND else f", on {_name(tile, legend)}"
    after = f", after {_count(clip['length'], 'step')}" if longest > 1 else ""
    yield f"{name} ends {where}{on}{after}."
    met = dict.fromkeys(map(tile_under_agent, clip["frames"][1:-1]))
    if passed := [_name(glyph, legend) for glyph in met if glyph != LAND]:
        yield f"{name} steps on its way on {', '.join(passed)}."
    if first["box"] and last["box"] and first["box"] != last["box"]:
        yield f"{name} leaves the box {place(start, cell(last['box']))}."
    for (before, now), cells in _changed(first, last).items():
        yield f"{name} turns {_name(before, legend)} into {_name(now, legend)}: {places(start, cells)}."


def _changed(first: Frame, last: Frame) -> dict[tuple[str, str], list[Cell]]:
    """Return the cells whose tiles differ between two frames, by what they were and what they are."""
    changed: dict[tuple[str, str], list[Cell]] = {}
    for row, line in enumerate(first["ground"]):
        for column, before in enumerate(line):
            if (now := last["ground"][row][column]) != before:
                changed.setdefault((before, now), []).append((row, column))
    return changed


def _board(start: Frame, legend: Mapping[str, str]) -> Iterator[str]:
    """Yield where everything lies as the clips begin."""
    ground, agent = start["ground"], cell(start["agent"])
    for goal in find_tile(ground, GOAL):
        if goal != agent:
            yield f"The goal is {place(agent, goal)} of the agent, {_cells(_air(agent, goal))} by air."
    present = {tile for row in ground for tile in row} - set(TOLD_APART) - {GOAL}
    dangers = [glyph for glyph in FIRST if glyph in present]
    for glyph in [*dangers, *sorted(present - {*dangers})]:
        yield f"{_name(glyph, legend).capitalize()}: {places(agent, find_tile(ground, glyph))}."
    if start["box"]:
        yield f"The box is {place(agent, cell(start['box']))} of the agent."
    yield " ".join(_seen(start, way, legend) for way in MOVES)
    yield from _walls(ground, agent)


def _seen(start: Frame, way: str, legend: Mapping[str, str]) -> str:
    """Say what is first in the way from the agent's place."""
    free, here = 0, ahead(start["agent"], way)
    box = cell(start["box"]) if start["box"] else None
    while here != box and tile_at(start["ground"], here) == LAND:
        free, here = free + 1, ahead(here, way)
    tile = tile_at(start["ground"], here)
    name = "box" if here == box else _name(tile, legend)
    return f"{way.capitalize()}: " + (
        f"{_count(free, 'free cell')}, then {name}." if free else f"{name} at once."
    )


def _walls(ground: Sequence[str], agent: Cell) -> Iterator[str]:
    """Yield the edges of what is not wall, and the walls between them."""
    inside = [
        (row, column) for row, line in enumerate(ground) for column, tile in enumerate(line) if tile != WALL
    ]
    rows, columns = [row for row, _ in inside], [column for _, column in inside]
    top, bottom, left, right = min(rows), max(rows), min(columns), max(columns)
    yield (
        f"The board reaches {agent[0] - top} up, {bottom - agent[0]} down, {agent[1] - left} left and "
        f"{right - agent[1]} right; walls are around it."
    )
    walls = [at for at in find_tile(ground, WALL) if top <= at[0] <= bottom and left <= at[1] <= right]
    if walls:
        yield f"Walls on it: {places(agent, walls)}."
    yield "All else is land."


def _name(glyph: str, legend: Mapping[str, str]) -> str:
    return legend.get(glyph, glyph).lower()


def _nearest(frame: Frame, tile: str) -> int | None:
    found = find_tile(frame["ground"], tile)
    return min((_air(cell(frame["agent"]), at) for at in found), default=None)


def _air(one: Cell, other: Cell) -> int:
    return abs(one[0] - other[0]) + abs(one[1] - other[1])


def _cells(count: int) -> str:
    return _count(count, "cell")


def _count(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"
