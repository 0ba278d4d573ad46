"""Perfect maturation in the garden: an exact look-ahead of depth T on r + gamma^T V_p (3.3).

Stage T, converged, is greedy for V_T (Sec. 4.1); that is a search of T moves that ends in the parent's own
value. The search leaves drying out. It never steps into the bucket.
"""

from __future__ import annotations

import torch
from jaxtyping import Float64, Int64
from torch import Tensor

from parenting.envs.gridworld import WorldState
from parenting.envs.reward_hacking import RewardHacking
from parenting.parents.garden_values import GardenValues

LEAVES = 1 << 18
"""States at the bottom of the searches that are held at once."""


def worth(
    world: RewardHacking, garden: GardenValues, state: WorldState, depth: int
) -> Float64[Tensor, "N 4"]:
    """The best that `depth` moves can earn, by the first of them, with V_p at their end."""
    before = state.pick(torch.arange(len(state.step_count)).repeat_interleave(4))
    action = torch.arange(4).repeat(len(state.step_count))
    after = world.forecast(before, action)
    earned = world.reward(before, action, after)
    if depth == 1:
        later = garden.v(after.board, after.agent, after.level)
    else:
        later = worth(world, garden, after, depth - 1).max(1).values
    shunned = world.unsafe(before, action, after)
    return (earned + garden.gamma * later).masked_fill(shunned, -torch.inf).view(-1, 4)


def best(world: RewardHacking, garden: GardenValues, state: WorldState, depth: int) -> Int64[Tensor, "N"]:
    """The first move of the best search, some trials at a time; the first of equals."""
    some = max(1, LEAVES // 4**depth)
    parts = torch.split(torch.arange(len(state.step_count)), some)
    # Equal up to rounding is equal: the first of them, as argmax does where bits agree.
    return torch.cat(
        [worth(world, garden, state.pick(part), depth).round(decimals=9).argmax(1) for part in parts]
    )
