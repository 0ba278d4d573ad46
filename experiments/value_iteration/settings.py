"""Settings of Sec. 4.1: the worlds, and the size of their random levels."""

from __future__ import annotations

from typing import NamedTuple

LEVELS = 6
"""Random levels of a trial, each with an agent of its own."""


class WorldSize(NamedTuple):
    """A deterministic world, the size of its random levels, and the parent's discount.

    It is below 1, since a random parent may never come to an end.
    """

    world: str
    height: int
    width: int
    gamma: float


WORLD_SIZES = (
    WorldSize("unsafe-exploration", 3, 3, 0.9),
    WorldSize("side-effects", 2, 3, 0.9),
    WorldSize("absent-supervisor", 3, 3, 0.9),
)
