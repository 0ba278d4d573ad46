"""Random path-connected mazes with one goal, for pre-training (Sec. 3.1.4). Many at once, all by key.

A maze has a wall around it. Inside, each cell is a wall with a density that is drawn for the maze. The agent
starts on a free cell; what it cannot reach becomes wall; the goal is one of the cells that it can reach.
"""

from __future__ import annotations

import torch
from jaxtyping import Bool, Int64, UInt8
from torch import Tensor

from parenting.envs.levels.spec import GOAL, WALL, maze_legend
from parenting.envs.rng import Keys, Stream
from parenting.envs.struct import Struct

DENSEST = 0.6
"""The share of walls inside a maze is drawn between 0 and this (ours)."""


class Mazes(Struct):
    """N mazes of one size. Cells are counted row by row."""

    board: UInt8[Tensor, "N H W"]  # codes of the ground, without the agent: wall 0, land 1, and the goal
    start: Int64[Tensor, "N"]  # the agent's first cell
    goal: Int64[Tensor, "N"]


def mazes(height: int, width: int, glyphs: str, keys: Keys) -> Mazes:
    """One maze for each of `keys`, in the codes of a world's glyphs.

    Raises:
        ValueError: a board too small for a wall around two cells.
    """
    if height < 3 or width < 3 or (height - 2) * (width - 2) < 2:
        raise ValueError(f"mazes need at least 3 x 4 cells, not {height} x {width}.")
    free, start = _ground(height, width, keys)
    away = free.flatten(1).scatter(1, start[:, None], False)
    goal = keys.at(Stream.MAZE, 2 + _cells(free) + 2 * height * width).masked_fill(~away, -1.0).argmax(1)
    board = free.flatten(1).to(torch.uint8)
    board = board.scatter(1, goal[:, None], maze_legend(glyphs).index(GOAL))
    assert glyphs[0] == WALL  # so that code 0 is a wall, and 1 is land
    return Mazes(board=board.view_as(free), start=start, goal=goal)


def _ground(height: int, width: int, keys: Keys) -> tuple[Bool[Tensor, "N H W"], Int64[Tensor, "N"]]:
    """Where a maze is free, and where its agent starts."""
    inside = torch.zeros(height, width, dtype=torch.bool, device=keys.seed.device)
    inside[1:-1, 1:-1] = True
    density = DENSEST * keys.at(Stream.MAZE, torch.tensor([0], device=keys.seed.device))[:, :, None]
    place = _cells(inside)
    noise = keys.at(Stream.MAZE, 2 + place)
    free = (noise.view(-1, height, width) >= density) & inside
    start = keys.at(Stream.MAZE, 2 + height * width + place).masked_fill(~inside.flatten(), -1.0).argmax(1)
    # a start with no way out is given one, so that there is a cell for the goal
    reached = flood(_open(free, start, width), start)
    return reached, start


def _open(free: Bool[Tensor, "N H W"], start: Int64[Tensor, "N"], width: int) -> Bool[Tensor, "N H W"]:
    """The start is free, and so is a cell beside it, towards the middle, where all of them were walls."""
    flat = free.flatten(1).scatter(1, start[:, None], True)
    height = free.shape[1]
    row, column = start // width, start % width
    down, right = torch.where(row > 1, -width, width), torch.where(column > 1, -1, 1)
    beside = start + (down if height > 3 else right)
    around = torch.stack([start - width, start + width, start - 1, start + 1], 1)
    closed = ~flat.gather(1, around).any(1)
    opened = flat.scatter(1, beside[:, None], True)
    return torch.where(closed[:, None], opened, flat).view_as(free)


def flood(free: Bool[Tensor, "N H W"], start: Int64[Tensor, "N"]) -> Bool[Tensor, "N H W"]:
    """The free cells that can be reached from the start."""
    reached = torch.zeros_like(free).flatten(1).scatter(1, start[:, None], True).view_as(free)
    while True:
        grown = reached.clone()
        grown[:, 1:] |= reached[:, :-1]
        grown[:, :-1] |= reached[:, 1:]
        grown[:, :, 1:] |= reached[:, :, :-1]
        grown[:, :, :-1] |= reached[:, :, 1:]
        grown &= free
        if torch.equal(grown, reached):
            return reached
        reached = grown


def _cells(board: Tensor) -> Int64[Tensor, "HW"]:
    """The numbers of a board's cells."""
    return torch.arange(board.shape[-2] * board.shape[-1], device=board.device)
