"""Gardens for experiments (Sec. 3.2.2, 3.3): which there are, and what happens where a policy is deployed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import torch
from jaxtyping import Bool, Float, Float64, Int64
from torch import Tensor

from agent.config import Config
from envs import registry
from envs.gridworld import WorldState
from envs.levels.kind import LAND, WALL, Level
from envs.reward_hacking import RewardHacking
from envs.rng import Keys, Stream, keys
from envs.struct import Struct
from parents.waterings import SEED, argmax
from weights.store import Wanted, shipped

WORLD = "reward-hacking"
GAMMA = 0.9
EPISODE = 10
"""Steps of an episode in Fig. 2."""
ROWS = 2000
"""Episodes walked at once. More need more memory and are no faster."""

Choose = Callable[[WorldState], Int64[Tensor, "N"]]
"""The action of every row in its state."""


class Deployed(Struct):
    """What happened in every episode of a deployment."""

    waterings: Float64[Tensor, "N E"]  # legitimate ones
    bucket: Int64[Tensor, "N E"]  # steps that end in the bucket
    caught: Bool[Tensor, "N E"]  # in the bucket when the episode ends


class SpreadGarden(RewardHacking):
    """A garden of one level whose episodes begin anywhere on bare soil, as drawn: so an agent sees more."""

    def reset(self, keys: Keys, level: Int64[Tensor, "N"]) -> WorldState:
        """As every garden, with the agent somewhere else."""
        start = super().reset(keys, level)
        soil = (start.board[:1] == self.code(LAND))[0].nonzero()
        drawn = keys.uniform(Stream.START) * len(soil)
        return start.replace(agent=soil[drawn.long()])


def garden(level: str, steps: int = EPISODE, bucket: bool = True) -> RewardHacking:
    """A built-in garden with episodes of so many steps; without `bucket`, a wall stands in its place."""
    drawn = registry.level(WORLD, level)
    world = registry.make(WORLD, drawn if bucket else without_bucket(drawn), time_limit=steps)
    assert isinstance(world, RewardHacking)
    return world


def spread(level: str, steps: int = EPISODE) -> SpreadGarden:
    """A built-in garden where episodes begin anywhere on bare soil."""
    return SpreadGarden([registry.level(WORLD, level)], time_limit=steps)


def without_bucket(level: Level) -> Level:
    """The same garden with a wall where the bucket stood, as in the world of Fig. 2's policy gradients."""
    return replace(level, rows=tuple(row.replace("O", WALL) for row in level.rows))


def weights_of(world: RewardHacking, config: Config) -> Float[Tensor, "P"] | None:
    """The shipped weights, where agents begin pre-trained (Sec. 3.1.4)."""
    if not config.pretrain:
        return None
    return shipped(Wanted(world.kind, world.height, world.width))


def deploy(
    world: RewardHacking, parameters: Float[Tensor, "N P"], episodes: int, seed: int = SEED
) -> Deployed:
    """Walk whole episodes by the argmax policy of every trial; all trials have the same weather."""
    together = max(1, ROWS // episodes)
    parts = [
        walked(world, lambda state, some=some: argmax(world, some, state), len(some), episodes, seed)  # type: ignore[misc]
        for some in torch.split(parameters, together)
    ]
    every = [part.tensors() for part in parts]
    return parts[0].map(lambda name, _tensor, _axis: torch.cat([one[name] for one in every]))


def walked(world: RewardHacking, choose: Choose, trials: int, episodes: int, seed: int = SEED) -> Deployed:
    """Whole episodes from the start of the first level, by whatever chooses."""
    weather = keys(seed, episodes).pick(torch.arange(episodes).repeat(trials))
    state = world.reset(weather, torch.zeros_like(weather.seed))
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
