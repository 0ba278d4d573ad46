"""A policy as arrows on its levels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray

from parenting.drawing.clip import Cell
from parenting.drawing.policy import draw_policy
from parenting.envs.levels.spec import Level
from parenting.evaluation.cells import cells_of
from parenting.library.pictures import Drawing
from parenting.library.worlds import World

Probabilities = Callable[[NDArray[np.uint8]], NDArray[np.float64]]
"""pi(a|s) of N observations, as codes [N, H, W]."""


def drawn(world: World, probabilities: Probabilities) -> Drawing:
    """Return the arrows on each of a world's levels."""
    each = [(level, arrows(world, probabilities, place)) for place, level in enumerate(world.levels)]
    return Drawing(
        [draw_policy(level, found, world.spec) for level, found in each],
        "\n\n".join(_as_text(level, found) for level, found in each),
    )


def arrows(world: World, probabilities: Probabilities, place: int = 0) -> dict[Cell, list[float]]:
    """Return pi(a|s) in every cell that the agent can come to, the rest as an episode begins there."""
    here = cells_of(world, world.beginnings().pick(torch.tensor([place])), place)
    found = probabilities(here.observation.numpy())
    return {cell: np.round(row, 6).tolist() for cell, row in zip(here.cells, found, strict=True)}


def _as_text(level: Level, found: dict[Cell, list[float]]) -> str:
    """Return the level with `^v<>` for the most probable action of each cell."""
    rows = [list(row) for row in level.rows]
    for (y, x), chances in found.items():
        rows[y][x] = "^v<>"[max(range(4), key=chances.__getitem__)]
    return "\n".join("".join(row) for row in rows)
