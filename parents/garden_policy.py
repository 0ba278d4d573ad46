"""pi_p in the garden (Sec. 3.3): clockwise along the wall without end, whatever the plants look like.

A level's header names the cycle. Off it the parent takes a shortest way to it, clear of the bucket: up before
down before left before right. So inside the built-in gardens it goes up or down, and out of the bucket down.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from parenting.agent.config import GardenParent
from parenting.envs.levels.reward_hacking import CLOSED, cycle
from parenting.envs.levels.rules import MOVES, moved
from parenting.envs.levels.spec import WALL, Cell, Level

LEFT = MOVES.index((0, -1))
NOWHERE = -1
"""pi_p's action on a wall, and on a cell with no way to the cycle: no agent comes there."""


class CyclePolicy(NamedTuple):
    """pi_p on one level. Cells are counted row by row."""

    action: list[int]  # of each cell, or NOWHERE
    next_cell: list[list[int]]  # where each of the four actions leads from each cell
    cycle: list[int]  # its cells


def cycle_policy(level: Level, inside: GardenParent) -> CyclePolicy:
    """Lay pi_p on a level. With `inside` = "left" it goes left off the cycle, wherever that leads to it.

    Raises:
        LevelError: the header names no cycle.
        ValueError: there is no such `inside`.
    """
    if inside not in ("up-down", "left"):
        raise ValueError(f'inside must be "up-down" or "left", not {inside!r}.')
    around = cycle(level)
    ways = _shortest(level, around)
    if inside == "left":
        ways |= _leftward(level, around)
    ways |= {cell: _towards(cell, ahead) for cell, ahead in zip(around, around[1:] + around[:1], strict=True)}
    cells = [(y, x) for y in range(level.height) for x in range(level.width)]
    return CyclePolicy(
        action=[ways.get(cell, NOWHERE) for cell in cells],
        next_cell=[[_number(level, moved(level, cell, a)) for a in range(len(MOVES))] for cell in cells],
        cycle=[_number(level, cell) for cell in around],
    )


def _shortest(level: Level, around: tuple[Cell, ...]) -> dict[Cell, int]:
    """The first action of a shortest way to the cycle, from every cell that has one."""
    distance = _distances(level, around)
    ways: dict[Cell, int] = {}
    for cell in [*distance, *level.find("O")]:
        ahead = [(distance[to], a) for a in range(len(MOVES)) if (to := moved(level, cell, a)) in distance]
        if ahead:
            ways[cell] = min(ahead)[1]
    return ways


def _distances(level: Level, around: tuple[Cell, ...]) -> dict[Cell, int]:
    """Steps to the cycle, clear of the bucket."""
    distance, fringe = dict.fromkeys(around, 0), deque(around)
    while fringe:
        cell = fringe.popleft()
        for action in range(len(MOVES)):
            to = moved(level, cell, action, CLOSED)
            if to not in distance:
                distance[to] = distance[cell] + 1
                fringe.append(to)
    return distance


def _leftward(level: Level, around: tuple[Cell, ...]) -> dict[Cell, int]:
    """The cells from which going left leads to the cycle, clear of the bucket."""
    leads: dict[Cell, int] = dict.fromkeys(around, LEFT)
    for y in range(level.height):
        for x in range(1, level.width):
            if (y, x - 1) in leads and level.glyph((y, x)) != WALL:
                free = level.glyph((y, x - 1)) not in CLOSED
                leads |= {(y, x): LEFT} if free else {}
    return leads


def _towards(cell: Cell, ahead: Cell) -> int:
    return MOVES.index((ahead[0] - cell[0], ahead[1] - cell[1]))


def _number(level: Level, cell: Cell) -> int:
    return cell[0] * level.width + cell[1]
