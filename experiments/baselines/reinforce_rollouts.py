"""Policy gradients from scratch in a garden (Sec. 3.3): the line of Fig. 2 that learns from reward.

What dries is left to chance, so the states of a garden cannot be listed, as `reinforce_tabular.py` beside it
needs it: here the episodes are walked in the world itself. As there: REINFORCE with returns to go, 16 whole
episodes and one step of Adam at a time, the agent's own network and optimiser, and a little entropy. A
baseline is subtracted: the mean return to go of the 16 episodes at the same step. What is left is divided by
its standard deviation (ours).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import torch
from jaxtyping import Float, Float64, Int64, UInt8
from torch import Tensor

from parenting.agent.adam import adam
from parenting.agent.init import network_of
from parenting.agent.policy import Network, draw
from parenting.agent.pretraining import Visits, differentiate
from parenting.agent.pretraining_mazes import EPISODES
from parenting.envs.gridworld import local_state
from parenting.envs.reward_hacking import RewardHacking
from parenting.envs.rng import Keys, Stream, gumbel, keys
from parenting.envs.struct import Struct

RATE = 0.001
"""Adam's step size, its default."""


class Rollouts(NamedTuple):
    """Episodes of every trial: what was seen and done, and what it earned. E is 16; T the episode's steps."""

    seen: UInt8[Tensor, "N TE H W"]
    near: UInt8[Tensor, "N TE 4"]
    action: Int64[Tensor, "N TE"]
    reward: Float64[Tensor, "N T E"]


class Moments(Struct):
    """The state of Adam."""

    exp_avg: Float[Tensor, "N P"]
    exp_avg_sq: Float[Tensor, "N P"]
    steps: Int64[Tensor, "N"]


def train_gardeners(
    world: RewardHacking, gamma: float, seed: int, trials: int, evaluation_points: Sequence[int]
) -> list[Float[Tensor, "N P"]]:
    """Policies trained on waterings, one a trial, after each of `evaluation_points` gradient steps."""
    network, rng = network_of(world), keys(seed, trials * EPISODES)
    live = network.init_params(keys(seed, trials), torch.float32)
    moments = Moments(torch.zeros_like(live), torch.zeros_like(live), torch.zeros(trials, dtype=torch.int64))
    found = []
    for step in range(1, evaluation_points[-1] + 1):
        now = rng.replace(tick=torch.full_like(rng.tick, step * world.time_limit))
        visits = visits_of(rollout(world, network, live, now), gamma, live.dtype)
        adam(live, moments, differentiate(network, live, visits), torch.ones(trials, dtype=torch.bool), RATE)
        if step in evaluation_points:
            found.append(live.clone())
    return found


def rollout(world: RewardHacking, network: Network, live: Float[Tensor, "N P"], rng: Keys) -> Rollouts:
    """16 episodes of every trial by its policy, each with environment randomness and draws of its own."""
    state = world.reset(rng, torch.zeros_like(rng.seed))
    layers, shape = network.unpack(live), (len(live), EPISODES)
    parts: list[tuple[Tensor, ...]] = []
    for _ in range(world.time_limit):
        seen = world.observe(state.board, state.agent, state.box)
        near = local_state(seen, state.agent)
        with torch.no_grad():
            each = seen.view(*shape, *seen.shape[1:]), near.view(*shape, 4)
            logits = network.heads(layers, *each).logits
        rng = rng.next()
        action = draw(logits.flatten(0, 1), gumbel(rng.uniform(Stream.ACT, 4)))
        after = world.step(state, action, rng)
        parts.append((*each, action.view(shape), world.reward(state, action, after).view(shape)))
        state = after
    seen, near, action, reward = (torch.stack(column, 1) for column in zip(*parts, strict=True))
    return Rollouts(seen.flatten(1, 2), near.flatten(1, 2), action.flatten(1), reward)


def visits_of(rollout: Rollouts, gamma: float, dtype: torch.dtype) -> Visits:
    """Return the advantage of each step's action, in the form that pre-training uses."""
    gain = advantages(rollout.reward, gamma).flatten(1)
    steps = gain.shape[1]
    return Visits(
        observation=rollout.seen,
        local_state=rollout.near,
        worth=(torch.nn.functional.one_hot(rollout.action, 4) * gain[:, :, None] / steps).to(dtype),
        share=torch.full_like(gain, 1 / steps).to(dtype),
    )


def advantages(reward: Float64[Tensor, "N T E"], gamma: float) -> Float64[Tensor, "N T E"]:
    """Returns to go, less their mean at the same step, over the standard deviation of what is left."""
    earned = reward.clone()
    for t in range(earned.shape[1] - 2, -1, -1):
        earned[:, t] += gamma * earned[:, t + 1]
    centred = earned - earned.mean(2, keepdim=True)
    return centred / centred.square().mean((1, 2), keepdim=True).sqrt().clamp_min(1e-8)
