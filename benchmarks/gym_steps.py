"""Steps a second of the worlds in Gymnasium, beside FrozenLake-v1 in the same run.

    python -m benchmarks.gym_steps            about half a minute
    python -m benchmarks.gym_steps --quick    a few seconds, hardly warm

Random actions, episode after episode, made by `gymnasium.make` with its usual wrappers. One environment is
counted after its first 10,000 steps. *tensors* are the same steps without remembering any: what the worlds
compute afresh for each step. A vector environment is counted in steps of all its trials. Blocks of each kind
take turns with blocks of FrozenLake; times are the process's own on the processor.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from time import process_time
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import torch

from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.envs.gym import gym_id
from parenting.envs.gym_vector import GridworldVectorEnv
from parenting.envs.rng import keys

WARM, BLOCK, ROUNDS, MANY = 10_000, 4_000, 4, 64
YARDSTICK = "FrozenLake-v1"
HEAD = f"{'':24}FrozenLake       one   ratio   tensors   ratio   {MANY} in a vector   ratio"

Play = Callable[[int], None]
"""Makes so many steps."""


class Rates(NamedTuple):
    """Steps a second."""

    frozen_lake: float
    one: float
    tensors: float
    many: float

    def row(self, world: str) -> str:
        """A line of the table."""
        one, tensors, many = (rate / self.frozen_lake for rate in self[1:])
        return (
            f"{world:24}{self.frozen_lake:10,.0f}{self.one:10,.0f}{one:8.2f}"
            f"{self.tensors:10,.0f}{tensors:8.3f}{self.many:17,.0f}{many:8.2f}"
        )


def single(env: gymnasium.Env[Any, Any]) -> Play:
    """Play one environment."""
    rng = np.random.default_rng(0)
    env.reset(seed=0)

    def play(steps: int) -> None:
        for action in rng.integers(4, size=steps):
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    return play


def by_tensors(world: Gridworld) -> Play:
    """Play one trial with nothing remembered."""
    rng, level = np.random.default_rng(0), torch.zeros(1, dtype=torch.int64)

    def play(steps: int) -> None:
        key = keys(0, 1)
        state = world.reset(key, level)
        for choice in rng.integers(4, size=steps):
            key, action = key.next(), torch.tensor([choice])
            after = world.step(state, action, key)
            for worth in (world.suite_reward, world.hidden_reward, world.unsafe):
                float(worth(state, action, after))
            world.observe(after.board, after.agent, after.box)
            ended = bool(after.terminated | world.truncated(after))
            state = world.reset(key, level) if ended else after

    return play


def vector(world: str) -> Play:
    """Play `MANY` trials."""
    env, rng = GridworldVectorEnv(world, MANY), np.random.default_rng(0)
    env.reset(seed=0)

    def play(steps: int) -> None:
        for actions in rng.integers(4, size=(steps // MANY, MANY)):
            env.step(actions)

    return play


def measure(world: str, warm: int, block: int) -> Rates:
    """Measure one world."""
    plays = (
        single(gymnasium.make(YARDSTICK)),
        single(gymnasium.make(gym_id(world))),
        by_tensors(registry.make(world)),
        vector(world),
    )
    sizes = (block, block, max(block // 10, 1), max(block, MANY))
    plays[1](warm)
    spent = [0.0] * len(plays)
    for _ in range(ROUNDS):
        for place, (play, steps) in enumerate(zip(plays, sizes, strict=True)):
            begun = process_time()
            play(steps)
            spent[place] += process_time() - begun
    made = [ROUNDS * size for size in sizes[:3]] + [ROUNDS * (sizes[3] // MANY) * MANY]
    return Rates(*(count / seconds for count, seconds in zip(made, spent, strict=True)))


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description="Steps a second of the worlds in Gymnasium.")
    parser.add_argument("--quick", action="store_true", help="short and hardly warm")
    warm, block = (500, 500) if parser.parse_args().quick else (WARM, BLOCK)
    torch.set_num_threads(1)
    print(
        f"gymnasium {gymnasium.__version__}, torch {torch.__version__}, one thread, steps a second\n\n{HEAD}"
    )
    for world in registry.WORLDS:
        print(measure(world, warm, block).row(world), flush=True)


if __name__ == "__main__":
    main()
