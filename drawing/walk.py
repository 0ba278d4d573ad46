"""Record a walk over an island as a clip, without the world's code: for pictures and for practice."""

from __future__ import annotations

from collections.abc import Sequence

from parenting.drawing.clip import AGENT, LAND, WALL, Cell, Clip, Frame, ahead, tile_at
from parenting.envs.levels.spec import Level
from parenting.envs.levels.unsafe_exploration import ENDS

WATER = "W"


def walk(level: Level, actions: Sequence[str], start: Cell | None = None) -> Clip:
    """Return the clip of a walk on an island (Sec. 3.2.1).

    A wall stops a step. Water and the goal end the walk, and what is left of its actions is not taken.

    Args:
        level: The island.
        actions: The moves, by name.
        start: The cell to begin at; by default that of the level.
    """
    ground = [row.replace(AGENT, LAND) for row in level.rows]
    at = level.find(AGENT)[0] if start is None else start
    done: list[str] = []
    frames = [_frame(ground, at)]
    for action in actions:
        if done and tile_at(ground, at) in ENDS:
            break
        there = ahead(at, action)
        at = at if tile_at(ground, there) == WALL else there
        done.append(action)
        frames.append(_frame(ground, at))
    return Clip(actions=done, length=len(done), frames=frames)


def _frame(ground: list[str], at: Cell) -> Frame:
    """Return a moment; the agent sees itself, except in the water."""
    row, column = at
    observed = list(ground)
    if ground[row][column] != WATER:
        observed[row] = ground[row][:column] + AGENT + ground[row][column + 1 :]
    return Frame(ground=ground, observed=observed, agent=list(at), box=None)
