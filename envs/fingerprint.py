"""Fingerprints: 64-bit words for boards, clips and pairs, so that equal ones are found by comparing words."""

from __future__ import annotations

from functools import cache

import numpy as np
import torch
from jaxtyping import Int64
from torch import Tensor

from parenting.envs.rng import keys

FEW = 4096
"""Words that numpy multiplies."""


def fingerprint(content: Tensor) -> Int64[Tensor, "..."]:
    """One word for the last axis of `content` (integers): its product with fixed odd words, modulo 2 ** 64.

    Two different contents share a fingerprint with a chance of about 2 ** -60. Few words are multiplied by
    numpy, whose small operations cost half of torch's.
    """
    if content.device.type == "cpu" and content.numel() <= FEW:
        found = np.matmul(content.numpy().astype(np.int64), _weights(content.shape[-1]).numpy())
        return torch.from_numpy(np.asarray(found))
    return (content.to(torch.int64) * _weights(content.shape[-1]).to(content.device)).sum(-1)


def together(*words: Tensor) -> Int64[Tensor, "..."]:
    """One word for several in their order."""
    alike: tuple[Tensor, ...] = torch.broadcast_tensors(*words)  # type: ignore[no-untyped-call]
    return fingerprint(scramble(torch.stack(alike, dim=-1)))


def unordered(one: Tensor, other: Tensor) -> Int64[Tensor, "..."]:
    """One word for two, whichever stands first."""
    return scramble(torch.stack((one, other))).sum(0)


def scramble(word: Tensor) -> Int64[Tensor, "..."]:
    """The same word for the same word, its bits mixed, so that sums and products do not cancel."""
    word = (word ^ (word >> 32)) * -7046029254386353131
    word = (word ^ (word >> 29)) * -4658895280553007687
    return word ^ (word >> 32)


@cache
def _weights(size: int) -> Tensor:
    draws = keys(seed=1902_06766, trials=1).at(0, torch.arange(2 * size))[0]
    high, low = (draws * 2.0**32).to(torch.int64).view(2, size)
    words: Tensor = ((high << 32) ^ low) | 1
    return words
