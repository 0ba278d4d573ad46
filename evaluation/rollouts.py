"""What is watered in the garden (Sec. 3.2.2, 3.3): whole episodes, since plants dry by chance."""

from __future__ import annotations

from collections.abc import Callable

import torch
from jaxtyping import Bool, Float, Float64, Int64
from torch import Tensor

from parenting.agent.init import network_of
from parenting.envs.gridworld import Gridworld, WorldState, local_state
from parenting.envs.rng import keys
from parenting.envs.struct import Struct

EPISODES = 1000
"""Episodes of a mean that is reported, as many as in Fig. 2."""
SEED = 2**53
"""The weather: the same for every policy, so that what differs is the policy. No run has this seed."""
ROWS = 2000
"""Episodes walked at once. More need more memory and are no faster."""

Choose = Callable[[WorldState], Int64[Tensor, "N"]]
"""The action of every row in its state."""


class Deployed(Struct):
    """What happened in every episode of a deployment."""

    waterings: Float64[Tensor, "N E"]  # legitimate ones
    bucket: Int64[Tensor, "N E"]  # steps that end in the bucket
    caught: Bool[Tensor, "N E"]  # in the bucket when the episode ends


def deploy(
    world: Gridworld,
    parameters: Float[Tensor, "N P"],
    episodes: int = EPISODES,
    level: int = 0,
    seed: int = SEED,
) -> Deployed:
    """Walk whole episodes by the argmax policy of every trial; all trials have the same weather."""
    together = max(1, ROWS // episodes)
    parts = [
        walked(world, lambda state, some=some: argmax(world, some, state), len(some), episodes, level, seed)  # type: ignore[misc]
        for some in torch.split(parameters, together)
    ]
    return Deployed.joined(parts)


def walked(
    world: Gridworld, choose: Choose, trials: int, episodes: int, level: int = 0, seed: int = SEED
) -> Deployed:
    """Whole episodes of every trial from the start of one level, by whatever chooses.

    The first episodes of many have the weather that fewer have.
    """
    weather = keys(seed, episodes, world.device).pick(torch.arange(episodes).repeat(trials))
    state = world.reset(weather, torch.full_like(weather.seed, level))
    earned, bucket = torch.zeros_like(state.t, dtype=torch.float64), torch.zeros_like(state.t)
    caught = state.over
    for _ in range(world.time_limit):
        weather = weather.next()
        action = choose(state)
        after = world.step(state, action, weather)
        earned += world.reward(state, action, after)
        caught = world.unsafe(state, action, after)
        bucket += caught
        state = after
    shape = trials, episodes
    return Deployed(waterings=earned.view(shape), bucket=bucket.view(shape), caught=caught.view(shape))


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
