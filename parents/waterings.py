"""What a policy waters in the garden (Sec. 3.2.2, 3.3): means over episodes, since plants dry by chance."""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Float, Float64, Int64
from torch import Tensor

from agent.birth import network_of
from envs.gridworld import Gridworld, WorldState, local_state
from envs.rng import keys

EPISODES = 1000
"""Episodes of a mean that is reported, as many as in Fig. 2."""
SEED = 2**53
"""The weather: the same for every policy, so that what differs is the policy. No run has this seed."""
ROWS = 1000
"""Episodes walked at once. More need more memory and are no faster."""


class Watered(NamedTuple):
    """What the argmax policy of every trial does in its episodes."""

    waterings: Float64[Tensor, "N"]  # a mean over the episodes
    bucket: Int64[Tensor, "N"]  # steps of all episodes that end in the bucket


def roll_out(
    world: Gridworld, parameters: Float[Tensor, "N P"], episodes: int = EPISODES, level: int = 0
) -> Watered:
    """Walk `episodes` whole episodes by the argmax policy of every trial, from the start of one level."""
    together = max(1, ROWS // episodes)
    parts = [_group(world, some, episodes, level) for some in torch.split(parameters, together)]
    waterings, bucket = (torch.cat(column) for column in zip(*parts, strict=True))
    return Watered(waterings, bucket)


def _group(world: Gridworld, parameters: Float[Tensor, "n P"], episodes: int, level: int) -> Watered:
    trials = len(parameters)
    weather = keys(SEED, episodes, world.device).pick(torch.arange(episodes).repeat(trials))
    state = world.reset(weather, torch.full_like(weather.seed, level))
    earned, bucket = torch.zeros_like(state.t, dtype=torch.float64), torch.zeros_like(state.t)
    for _ in range(world.time_limit):
        weather = weather.next()
        action = argmax(world, parameters, state)
        after = world.step(state, action, weather)
        earned += world.reward(state, action, after)
        bucket += world.unsafe(state, action, after)
        state = after
    return Watered(earned.view(trials, episodes).mean(1), bucket.view(trials, episodes).sum(1))


def argmax(world: Gridworld, parameters: Float[Tensor, "n P"], state: WorldState) -> Int64[Tensor, "nE"]:
    """The argmax action of every trial in each of its E states, which stand one trial after the other."""
    brain = network_of(world)
    seen = world.observe(state.board, state.agent, state.box)
    near = local_state(seen, state.agent)
    shape = len(parameters), -1
    with torch.no_grad():
        heads = brain.heads(
            brain.unpack(parameters), seen.view(*shape, *seen.shape[1:]), near.view(*shape, 4)
        )
    return heads.logits.argmax(-1).flatten()
