"""Level rules that more than one world has, and the plain search behind them. No torch here.

The search moves as `Gridworld.step` does; a conformance test holds the two equal.
"""

from __future__ import annotations

from collections import deque

from parenting.envs.levels.spec import AGENT, WALL, Cell, Level

MOVES: tuple[Cell, ...] = ((-1, 0), (1, 0), (0, -1), (0, 1))
"""Up, down, left, right: row and column of each action, in the order of the actions."""

LETTERS = "udlr"
"""Up, down, left, right: the letter of each action, in the order of the actions."""


def moved(level: Level, cell: Cell, action: int, walls: str = WALL) -> Cell:
    """Where a move ends: the glyphs of `walls` and the board's edge stop it."""
    row, column = cell[0] + MOVES[action][0], cell[1] + MOVES[action][1]
    inside = 0 <= row < level.height and 0 <= column < level.width
    return (row, column) if inside and level.glyph((row, column)) not in walls else cell


def reachable(level: Level, ends: str, walls: str = WALL) -> set[Cell]:
    """Every cell that the agent can come to; `ends` end the episode, so nothing is reached through them."""
    (start,) = level.find(AGENT)
    found, fringe = {start}, deque([start])
    while fringe:
        cell = fringe.popleft()
        if level.glyph(cell) in ends:
            continue
        fresh = {moved(level, cell, action, walls) for action in range(len(MOVES))} - found
        found |= fresh
        fringe.extend(sorted(fresh))
    return found


def one(level: Level, glyph: str, name: str) -> Cell:
    """The one cell of a glyph that a level must show exactly once.

    Raises:
        LevelError: at the first cell of the art where there is none, at the second one where there are more.
    """
    cells = level.find(glyph)
    if not cells:
        raise level.wrong((0, 0), f"a level needs a {name} ({glyph}), and this one has none")
    if len(cells) > 1:
        raise level.wrong(cells[1], f"a level has one {name} ({glyph}), and this is another")
    return cells[0]


def goal_in_reach(level: Level, found: set[Cell], goal: Cell) -> None:
    """The goal must be among the cells found by safe moves."""
    if goal not in found:
        raise level.wrong(goal, "the goal must be in reach of the agent by safe moves, and this one is not")


def edge_closed(level: Level, found: set[Cell], ends: str) -> None:
    """At the edge the agent may meet only walls and what ends the episode, so that it cannot walk on."""
    for row, column in sorted(found):
        edge = row in (0, level.height - 1) or column in (0, level.width - 1)
        if edge and level.glyph((row, column)) not in ends:
            rule = "the agent can reach this cell at the edge and walk on from it; put a wall here"
            raise level.wrong((row, column), rule)
