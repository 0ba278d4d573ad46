"""Random walks in a world, and the marks of the checks that every world must pass."""

from typing import Any

import pytest
import torch

from parenting.envs import registry
from parenting.envs.gridworld import Gridworld, WorldState
from parenting.envs.rng import Keys, keys

CERTAIN: dict[str, dict[str, Any]] = {
    "reward-hacking": {"drying": 0.0},
    "interruptibility": {"interrupts": False},
    "absent-supervisor": {"supervised": True},
}
"""For a world with chance: the options that leave nothing to it."""

every_world = pytest.mark.every_world  # tests/envs/conftest.py says of which worlds: here, of the registry's
every_level = pytest.mark.every_level


def certain(name: str, level: str | None = None) -> Gridworld:
    return registry.make(name, level, **CERTAIN.get(name, {}))


def begin(world: Gridworld, trials: int, seed: int = 0) -> tuple[WorldState, Keys]:
    key = keys(seed, trials)
    return world.reset(key, torch.arange(trials) % len(world.levels)), key


def roll(world: Gridworld, trials: int, steps: int, seed: int = 0) -> list[tuple[WorldState, torch.Tensor]]:
    """Random walks: each state with the action taken in it; the last action is not taken any more."""
    generator = torch.Generator().manual_seed(seed)
    state, key = begin(world, trials, seed)
    passed = []
    for _ in range(steps + 1):
        action = torch.randint(4, (trials,), generator=generator)
        passed.append((state, action))
        key = key.next()
        state = world.step(state, action, key)
    return passed


def same(one: WorldState, other: WorldState) -> bool:
    theirs = other.tensors()
    return all(torch.equal(tensor, theirs[name]) for name, tensor in one.tensors().items())
