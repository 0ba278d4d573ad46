"""Observations as Gymnasium gives them, and the local state l(s) that is read from them."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from jaxtyping import UInt8
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from parenting.envs.gridworld import local_state
from parenting.envs.levels.spec import AGENT
from parenting.library.worlds import World


def codes(world: World, observation: ArrayLike) -> tuple[UInt8[Tensor, "N H W"], bool]:
    """Return observations as codes of glyphs, and whether there was one alone.

    Args:
        world: The world that they come from.
        observation: One-hot bits (H, W, O) or codes (H, W), or N of either.

    Raises:
        ValueError: The shape fits neither, or a code or bit does not exist.
    """
    array = np.asarray(observation)
    board = (world.height, world.width)
    if array.shape[-3:] == (*board, len(world.legend)) and array.ndim in (3, 4):
        _check_bits(array)
        array = array.argmax(-1)
    if array.shape[-2:] != board or array.ndim not in (2, 3):
        height, width, tiles = *board, len(world.legend)
        raise ValueError(
            f"observation: {world.name} at this size shows one-hot bits of shape ({height}, {width}, {tiles})"
            f" or codes of shape ({height}, {width}), or N of either; not {np.shape(observation)}."
        )
    _check_codes(array, len(world.legend))
    found = torch.from_numpy(np.ascontiguousarray(array, dtype=np.uint8))
    return (found[None], True) if array.ndim == 2 else (found, False)


def _check_bits(array: NDArray[Any]) -> None:
    """Refuse what does not have exactly one 1 in each cell."""
    if array.dtype.kind not in "biuf" or not (((array == 0) | (array == 1)).all() and _ones(array)):
        raise ValueError("observation: in one-hot bits each cell has one 1, and 0 for all other tiles.")


def _ones(array: NDArray[Any]) -> bool:
    return bool((array.sum(-1, dtype=np.int64) == 1).all())


def _check_codes(array: NDArray[Any], tiles: int) -> None:
    """Refuse codes of tiles that the world does not have."""
    if array.dtype.kind not in "biu" or not ((array >= 0) & (array < tiles)).all():
        raise ValueError(f"observation: codes are whole numbers from 0 to {tiles - 1}, one for each tile.")


def local_states(world: World, seen: UInt8[Tensor, "N H W"]) -> UInt8[Tensor, "N 4"]:
    """Return l(s) (Sec. 2) of each observation: the codes of the cells up, down, left and right.

    An agent that drowned is not drawn. Its episode is over, so that no action matters: it counts as standing
    in the first cell.
    """
    cell = (seen == world.code(AGENT)).flatten(1).byte().argmax(1)
    agent = torch.stack((cell // world.width, cell % world.width), 1)
    return local_state(seen, agent)
