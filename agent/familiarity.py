"""Familiarity f(l): the number of guidance queries already made in the local state l(s) (Sec. 2.1)."""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float64, Int64, UInt8
from torch import Tensor


def n_local_states(codes: int) -> int:
    """The number of local states: each of the 4 cells within reach holds one of `codes` things."""
    return int(codes**4)


def local_state_index(local_state: UInt8[Tensor, "N 4"], codes: int) -> Int64[Tensor, "N"]:
    """The number of a local state l(s)."""
    up, down, left, right = local_state.long().unbind(-1)
    return ((up * codes + down) * codes + left) * codes + right


def ask_chance(f: Int64[Tensor, "N"], p_guid: float) -> Float64[Tensor, "N"]:
    """p_guid ** f: 1 where the agent never asked; `p_guid` = 0 switches guidance off altogether."""
    if p_guid == 0:
        return torch.zeros_like(f, dtype=torch.float64)
    return torch.pow(torch.tensor(p_guid, dtype=torch.float64, device=f.device), f)


def count(familiarity: Int64[Tensor, "N L"], where: Int64[Tensor, "N"], asked: Bool[Tensor, "N"]) -> Tensor:
    """One more query in l(s) where the agent asked; redraws count too. Updates in place."""
    return familiarity.scatter_add_(1, where[:, None], asked.long()[:, None])
