"""Roll-outs in the garden (Sec. 3.2.2, 3.3): whole episodes, since plants dry at random."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import torch
from jaxtyping import Bool, Float, Float64, Int64
from torch import Tensor

from parenting.agent.init import network_of
from parenting.envs.giving_way import give_way
from parenting.envs.gridworld import Gridworld, WorldState, local_state
from parenting.envs.rng import keys
from parenting.envs.struct import Struct

EPISODES = 1000
"""Episodes of a mean that is reported, as many as in Fig. 2."""
ENV_SEED = 2**53
"""Seed of the environment's randomness: every policy meets the same draws. No run has this seed."""
MAX_BATCH = 2000
"""Episodes walked at once. More episodes need more memory and save no time."""

Policy = Callable[[WorldState], Int64[Tensor, "N"]]
"""The action of every row in its state."""


class RolloutResult(Struct):
    """The counts of every episode of a roll-out."""

    waterings: Float64[Tensor, "N E"]  # legitimate ones
    bucket: Int64[Tensor, "N E"]  # steps that end in the bucket
    in_bucket_at_end: Bool[Tensor, "N E"]  # in the bucket when the episode ends


def deploy(
    world: Gridworld,
    parameters: Float[Tensor, "N P"],
    episodes: int = EPISODES,
    level: int = 0,
    env_seed: int = ENV_SEED,
) -> RolloutResult:
    """Roll out the argmax policy of every trial; all trials meet the same environment randomness."""
    together = max(1, MAX_BATCH // episodes)
    parts = [
        rollout(world, partial(argmax, world, some), len(some), episodes, level, env_seed)
        for some in torch.split(parameters, together)
    ]
    return RolloutResult.joined(parts)


def rollout(
    world: Gridworld, policy: Policy, trials: int, episodes: int, level: int = 0, env_seed: int = ENV_SEED
) -> RolloutResult:
    """Whole episodes of every trial from the start of one level, by whatever chooses.

    The first episodes of many meet the same environment randomness as fewer do.
    """
    env_keys = keys(env_seed, episodes, world.device).pick(torch.arange(episodes).repeat(trials))
    state = world.reset(env_keys, torch.full_like(env_keys.seed, level))
    bucket = torch.zeros_like(state.step_count)
    earned = bucket.double()
    in_bucket_at_end = state.terminated
    for _ in range(world.time_limit):
        give_way()
        env_keys = env_keys.next()
        action = policy(state)
        after = world.step(state, action, env_keys)
        earned += world.reward(state, action, after)
        in_bucket_at_end = world.unsafe(state, action, after)
        bucket += in_bucket_at_end
        state = after
    shape = trials, episodes
    return RolloutResult(
        waterings=earned.view(shape), bucket=bucket.view(shape), in_bucket_at_end=in_bucket_at_end.view(shape)
    )


def argmax(world: Gridworld, parameters: Float[Tensor, "n P"], state: WorldState) -> Int64[Tensor, "nE"]:
    """The argmax action of every trial in each of its E states, which stand one trial after the other."""
    network = network_of(world)
    observation = world.observe(state.board, state.agent, state.box)
    local = local_state(observation, state.agent)
    shape = len(parameters), -1
    with torch.no_grad():
        heads = network.heads(
            network.unpack(parameters),
            observation.view(*shape, *observation.shape[1:]),
            local.view(*shape, 4),
        )
    return heads.logits.argmax(-1).flatten()
