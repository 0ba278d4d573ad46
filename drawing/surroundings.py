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
from parenting.drawing.sentences import tr, trn

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
        found += _end(tr(name.capitalize()), clip, longest, legend)
    return (*found, *_board(start, legend))


def _difference(sides: Sequence[tuple[str, Clip]], aim: str, legend: Mapping[str, str]) -> Iterator[str]:
    """Yield how far the goal is after each clip, or in a world without one the nearest dry plant."""
    (one, first), (other, second) = ((name, clip["frames"][-1]) for name, clip in sides)
    if first == second:
        yield tr("Both end alike.")
    if aim not in legend:
        return
    near, far = _nearest(first, aim), _nearest(second, aim)
    if near is None or far is None:
        return
    values = {"near": _cells(near), "one": tr(one), "far": _cells(far), "other": tr(other)}
    if aim == GOAL:
        yield tr("By air the goal is {near} away after {one}, and {far} after {other}.", **values)
    else:
        yield tr(
            "By air the nearest {tile} is {near} away after {one}, and {far} after {other}.",
            tile=_name(aim, legend),
            **values,
        )


def _ways(sides: Sequence[tuple[str, Clip]], aim: str) -> str:
    ways = [
        (tr("none") if steps is None else _steps(steps), tr(name))
        for name, steps in ((name, safe_steps(clip["frames"][-1], aim)) for name, clip in sides)
    ]
    told = [tr("{steps} after {name}", steps=steps, name=name) for steps, name in ways]
    return tr("By a safe way: {first}, {second}.", first=told[0], second=told[1])


def _end(name: str, clip: Clip, longest: int, legend: Mapping[str, str]) -> Iterator[str]:
    """Yield where a clip ends, what it meets on its way, and what is not as it was."""
    first, last = clip["frames"][0], clip["frames"][-1]
    start = cell(first["agent"])
    yield tr("{name} ends {ending}.", name=name, ending=_ending(clip, longest, legend))
    met = dict.fromkeys(map(tile_under_agent, clip["frames"][1:-1]))
    if passed := [_name(glyph, legend) for glyph in met if glyph != LAND]:
        yield tr("{name} steps on its way on {tiles}.", name=name, tiles=", ".join(passed))
    if first["box"] and last["box"] and first["box"] != last["box"]:
        yield tr("{name} leaves the box {place}.", name=name, place=place(start, cell(last["box"])))
    for (before, now), cells in _changed(first, last).items():
        turned = {"before": _name(before, legend), "now": _name(now, legend)}
        yield tr(
            "{name} turns {before} into {now}: {places}.", name=name, places=places(start, cells), **turned
        )


def _ending(clip: Clip, longest: int, legend: Mapping[str, str]) -> str:
    """Say where a clip ends, on which tile unless it is land, and after how many steps unless that is one."""
    first, last = clip["frames"][0], clip["frames"][-1]
    stays, tile = first["agent"] == last["agent"], tile_under_agent(last)
    parts = [tr("where it begins") if stays else place(cell(first["agent"]), cell(last["agent"]))]
    if tile != LAND:
        parts.append(tr("on {tile}", tile=_name(tile, legend)))
    if longest > 1:
        parts.append(tr("after {steps}", steps=_steps(clip["length"])))
    return ", ".join(parts)


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
            yield tr(
                "The goal is {place} of the agent, {cells} by air.",
                place=place(agent, goal),
                cells=_cells(_air(agent, goal)),
            )
    present = {tile for row in ground for tile in row} - set(TOLD_APART) - {GOAL}
    dangers = [glyph for glyph in FIRST if glyph in present]
    for glyph in [*dangers, *sorted(present - {*dangers})]:
        where = places(agent, find_tile(ground, glyph))
        yield tr("{tile}: {places}.", tile=_name(glyph, legend).capitalize(), places=where)
    if start["box"]:
        yield tr("The box is {place} of the agent.", place=place(agent, cell(start["box"])))
    yield " ".join(_seen(start, way, legend) for way in MOVES)
    yield from _walls(ground, agent)


def _seen(start: Frame, way: str, legend: Mapping[str, str]) -> str:
    """Say what is first in the way from the agent's place."""
    free, here = 0, ahead(start["agent"], way)
    box = cell(start["box"]) if start["box"] else None
    while here != box and tile_at(start["ground"], here) == LAND:
        free, here = free + 1, ahead(here, way)
    tile = tile_at(start["ground"], here)
    name = tr("box") if here == box else _name(tile, legend)
    if not free:
        return tr("{way}: {tile} at once.", way=tr(way).capitalize(), tile=name)
    cells = trn("{count} free cell", "{count} free cells", free)
    return tr("{way}: {cells}, then {tile}.", way=tr(way).capitalize(), cells=cells, tile=name)


def _walls(ground: Sequence[str], agent: Cell) -> Iterator[str]:
    """Yield the edges of what is not wall, and the walls between them."""
    inside = [
        (row, column) for row, line in enumerate(ground) for column, tile in enumerate(line) if tile != WALL
    ]
    rows, columns = [row for row, _ in inside], [column for _, column in inside]
    top, bottom, left, right = min(rows), max(rows), min(columns), max(columns)
    yield tr(
        "The board reaches {up} up, {down} down, {left} left and {right} right; walls are around it.",
        up=agent[0] - top,
        down=bottom - agent[0],
        left=agent[1] - left,
        right=right - agent[1],
    )
    walls = [at for at in find_tile(ground, WALL) if top <= at[0] <= bottom and left <= at[1] <= right]
    if walls:
        yield tr("Walls on it: {places}.", places=places(agent, walls))
    yield tr("All else is land.")


def _name(glyph: str, legend: Mapping[str, str]) -> str:
    return tr(legend.get(glyph, glyph)).lower()


def _nearest(frame: Frame, tile: str) -> int | None:
    found = find_tile(frame["ground"], tile)
    return min((_air(cell(frame["agent"]), at) for at in found), default=None)


def _air(one: Cell, other: Cell) -> int:
    return abs(one[0] - other[0]) + abs(one[1] - other[1])


def _cells(count: int) -> str:
    return trn("{count} cell", "{count} cells", count)


def _steps(count: int) -> str:
    return trn("{count} step", "{count} steps", count)
