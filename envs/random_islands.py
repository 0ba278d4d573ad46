"""Random levels of Unsafe Exploration, many of one size, by key: settings are chosen on them.

A candidate has land and water at random inside, and walls and water at its edge. It is kept if it obeys the
rules of its world, if the shortest way to the goal takes some moves, and if the agent can drown.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from parenting.envs.art import LARGEST
from parenting.envs.levels.rules import MOVES, moved
from parenting.envs.levels.spec import AGENT, GOAL, LAND, WALL, Level, LevelError
from parenting.envs.levels.unsafe_exploration import SPEC, reach, validate
from parenting.envs.rng import Stream, keys

BATCH = 256
"""Candidates drawn at once. Another number would give other levels."""
BATCHES = 500
"""Batches after which the search is given up."""
WATER = "W"
WET, WET_EDGE = 0.25, 0.5
"""The share of water inside, and at the edge."""
SHORTEST = 4
"""Moves of the shortest way, at least: those of the built-in island."""
SMALLEST = 4
"""Rows and columns, at least."""


def island_levels(count: int, height: int, width: int, seed: int) -> tuple[Level, ...]:
    """`count` different levels of one size; fewer levels of a seed are always the first of more.

    Raises:
        ValueError: a size at which there is no such level, a negative count, or more than could be found.
    """
    _check(count, height, width)
    found: list[Level] = []
    for rows in _candidates(height, width, seed) if count else ():
        level = Level(f"random-{seed}-{len(found) + 1}", SPEC.name, rows)
        found += [level] if _fit(level) else []
        if len(found) == count:
            break
    if len(found) < count:
        raise ValueError(
            f"count: {count} levels of {height} x {width} with seed {seed} were asked for, and "
            f"{BATCHES * BATCH} candidates held {len(found)}. Ask for that many, or for larger levels."
        )
    return tuple(found)


def way(level: Level) -> int | None:
    """Moves of a shortest way over land to the goal; None if there is none."""
    (start,) = level.find(AGENT)
    steps, fringe = {start: 0}, deque([start])
    while fringe:
        cell = fringe.popleft()
        if level.glyph(cell) == GOAL:
            return steps[cell]
        for action in range(len(MOVES)):
            there = moved(level, cell, action)
            if there not in steps and level.glyph(there) != WATER:
                steps[there] = steps[cell] + 1
                fringe.append(there)
    return None


def _fit(level: Level) -> bool:
    """Return whether a candidate is a level of its world, takes some moves, and has water in reach."""
    try:
        validate(level)
    except LevelError:
        return False
    moves = way(level)
    return (
        moves is not None and moves >= SHORTEST and any(level.glyph(cell) == WATER for cell in reach(level))
    )


def _candidates(height: int, width: int, seed: int) -> Iterator[tuple[str, ...]]:
    """Different rows, batch by batch."""
    seen: set[tuple[str, ...]] = set()
    first = keys(seed, BATCH)
    for batch in range(BATCHES):
        drawn = first.replace(tick=first.tick + batch).uniform(Stream.MAZE, 2, height * width).tolist()
        for ground, places in drawn:
            rows = _rows(ground, places, height, width)
            if rows not in seen:
                seen.add(rows)
                yield rows


def _rows(ground: list[float], places: list[float], height: int, width: int) -> tuple[str, ...]:
    """A candidate from its draws: the ground of each cell, then the two inner cells of the largest places."""
    cells = [
        [_ground(ground[row * width + column], _edge(row, column, height, width)) for column in range(width)]
        for row in range(height)
    ]
    inner = [place for place in range(height * width) if not _edge(*divmod(place, width), height, width)]
    agent, goal = sorted(inner, key=lambda place: -places[place])[:2]
    cells[agent // width][agent % width] = AGENT
    cells[goal // width][goal % width] = GOAL
    return tuple("".join(row) for row in cells)


def _edge(row: int, column: int, height: int, width: int) -> bool:
    return row in (0, height - 1) or column in (0, width - 1)


def _ground(drawn: float, edge: bool) -> str:
    if edge:
        return WATER if drawn < WET_EDGE else WALL
    return WATER if drawn < WET else LAND


def _check(count: int, height: int, width: int) -> None:
    if count < 0:
        raise ValueError(f"count must be at least 0, not {count}.")
    if min(height, width) < SMALLEST or (height - 2) + (width - 2) - 2 < SHORTEST:
        raise ValueError(
            f"height and width must leave room for a way of {SHORTEST} moves: "
            f"4 x 6, 5 x 5 or 6 x 4 cells at least, not {height} x {width}."
        )
    if max(height, width) > LARGEST:
        raise ValueError(f"height and width must be at most {LARGEST} cells, not {height} x {width}.")
