"""Random walks in a world, and the search for every state that its steps can come to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import torch
from torch import Tensor

from parenting.envs import registry
from parenting.envs.gridworld import Gridworld, WorldState
from parenting.envs.levels.spec import Level, WorldSpec
from parenting.envs.rng import Keys, keys


class ConformanceError(AssertionError):
    """A world lacks a property that every world has; the sentence names world, level and property."""


class Subject(NamedTuple):
    """One level of a world that is checked."""

    world: str
    level: str
    certain: Mapping[str, Any]  # the options that leave nothing to chance

    @property
    def spec(self) -> WorldSpec:
        """The world's record."""
        return registry.spec(self.world)

    @property
    def drawn(self) -> Level:
        """The level as it is read."""
        return registry.level(self.world, self.level)

    def make(self) -> Gridworld:
        """Make the world with its default options."""
        return registry.make(self.world, self.level)

    def make_certain(self) -> Gridworld:
        """Make the world with as little chance as its options allow."""
        return registry.make(self.world, self.level, **self.certain)

    def hold(self, holds: bool, otherwise: str) -> None:
        """Check something.

        Raises:
            ConformanceError: it does not hold.
        """
        if not holds:
            raise ConformanceError(f"{self.world}, level {self.level}: {otherwise}.")


def begin(world: Gridworld, trials: int, seed: int = 0) -> tuple[WorldState, Keys]:
    """Begin an episode in each of N trials, on the world's levels in rotation."""
    key = keys(seed, trials)
    return world.reset(key, torch.arange(trials) % len(world.levels)), key


def roll(world: Gridworld, trials: int, steps: int, seed: int = 0) -> list[tuple[WorldState, Tensor]]:
    """Walk at random: each state with the action taken in it; the last action is not taken any more."""
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
    """Return whether two stacks of states are the same in every tensor."""
    theirs = other.tensors()
    return all(torch.equal(tensor, theirs[name]) for name, tensor in one.tensors().items())


def explore(world: Gridworld) -> WorldState:
    """Return every (agent, box, ways) that `step` can come to from the first level's start, as trials.

    The ways are the cells that stop the agent or end the episode: a door may open.
    """
    key = keys(0, trials=1)
    found = fringe = world.reset(key, torch.zeros(1, dtype=torch.int64))
    barred = world.lookup(world.walls + world.ends)
    seen = {_places(fringe, barred)[0]}
    while len(fringe.step_count):
        parts = [world.step(fringe, torch.full_like(fringe.step_count, action), key) for action in range(4)]
        fringe = WorldState.joined([_fresh(part, barred, seen) for part in parts])
        found = WorldState.joined([found, fringe])
    return found


def _places(state: WorldState, barred: Tensor) -> list[tuple[object, ...]]:
    ways = barred[state.board.long()]
    places = zip(state.agent.tolist(), state.box.tolist(), ways, strict=True)
    return [(*agent, *box, cells.numpy().tobytes()) for agent, box, cells in places]


def _fresh(state: WorldState, barred: Tensor, seen: set[tuple[object, ...]]) -> WorldState:
    new = []
    for trial, place in enumerate(_places(state, barred)):
        if place not in seen:
            seen.add(place)
            new.append(trial)
    return state.pick(torch.tensor(new, dtype=torch.int64))
