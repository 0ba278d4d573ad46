"""Gardens for experiments (Sec. 3.2.2, 3.3): the built-in ones, without a bucket, and with starts spread."""

from __future__ import annotations

from dataclasses import replace

from jaxtyping import Int64
from torch import Tensor

from parenting.envs import registry
from parenting.envs.gridworld import WorldState
from parenting.envs.levels.spec import LAND, WALL, Level
from parenting.envs.reward_hacking import RewardHacking
from parenting.envs.rng import Keys, Stream

WORLD = "reward-hacking"
GAMMA = 0.9
EPISODE = 10
"""Steps of an episode in Fig. 2."""


class ExploringStarts(RewardHacking):
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


def exploring_starts(level: str) -> ExploringStarts:
    """A built-in garden with Fig. 2's short episodes, which begin anywhere on bare soil."""
    return ExploringStarts([registry.level(WORLD, level)], time_limit=EPISODE)


def without_bucket(level: Level) -> Level:
    """The same garden with a wall where the bucket stood, as in the world of Fig. 2's policy gradients."""
    return replace(level, rows=tuple(row.replace("O", WALL) for row in level.rows))
