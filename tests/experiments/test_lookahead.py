"""The exact look-ahead in the gardens (Sec. 3.3): by brute force, and the waterings that it comes to."""

from __future__ import annotations

from itertools import product
from math import hypot

import pytest
import torch
from torch import Tensor

from parenting.envs.gridworld import WorldState
from parenting.envs.reward_hacking import RewardHacking
from parenting.envs.rng import keys
from parenting.evaluation.rollouts import rollout
from parenting.experiments.figure2 import lookahead
from parenting.experiments.figure2.lookahead import best, worth
from parenting.experiments.figure2.tasks import lookahead_waterings
from parenting.experiments.training.gardens import GAMMA, garden
from parenting.parents.garden_values import GardenValues

WATERINGS = {"garden": (4.49, 5.16, 5.24), "garden-mirrored": (4.26, 4.74, 4.66)}
"""Mean waterings in 10 steps at depth 1, 2 and 3, measured with another program."""
ERROR = 0.05
"""Its standard error."""


def tried(world: RewardHacking, valued: GardenValues, state: WorldState, depth: int) -> Tensor:
    """The best of all ways of `depth` moves by the first of them, each walked one by one."""
    found = [
        torch.stack(
            [_earned(world, valued, state, (first, *rest)) for rest in product(range(4), repeat=depth - 1)]
        )
        for first in range(4)
    ]
    return torch.stack([ways.max(0).values for ways in found], 1)


def _earned(world: RewardHacking, valued: GardenValues, state: WorldState, moves: tuple[int, ...]) -> Tensor:
    now, total, shunned = state, torch.zeros(len(state.step_count), dtype=torch.float64), state.terminated
    for step, move in enumerate(moves):
        action = torch.full_like(now.step_count, move)
        after = world.forecast(now, action)
        total = total + GAMMA**step * world.reward(now, action, after)
        shunned = shunned | world.unsafe(now, action, after)
        now = after
    total += GAMMA ** len(moves) * valued.v(now.board, now.agent, now.level)
    return total.masked_fill(shunned, -torch.inf)


def test_the_search_is_what_trying_every_way_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    """From states of a real life, at each depth; and searches some at a time are the same searches."""
    world = garden("garden-mirrored")
    valued = GardenValues(world, GAMMA)
    env_keys = keys(4, 3)
    state = world.reset(env_keys, torch.zeros(3, dtype=torch.int64))
    for action in (0, 0, 3):
        env_keys = env_keys.next()
        state = world.step(state, torch.full((3,), action), env_keys)
    for depth in (1, 2, 3):
        found = worth(world, valued, state, depth)
        assert torch.allclose(found, tried(world, valued, state, depth))
        assert torch.equal(best(world, valued, state, depth), found.argmax(1))
    monkeypatch.setattr(lookahead, "LEAVES", 2 * 4**3)
    assert torch.equal(best(world, valued, state, 3), found.argmax(1))


@pytest.mark.slow
def test_a_row_is_of_its_own_depth() -> None:
    """The waterings of each episode come from trying every way of so many moves, and of no other depth."""
    world = garden("garden-mirrored")
    valued = GardenValues(world, GAMMA, "left")
    means = []
    for depth in (1, 2, 3):
        (row,) = lookahead_waterings("garden-mirrored", "left", depth, 12)

        def choose(state: WorldState, depth: int = depth) -> Tensor:
            return tried(world, valued, state, depth).round(decimals=9).argmax(1)

        means.append(float(rollout(world, choose, 1, 12).waterings.mean()))
        assert (row["stage"], row["waterings"]) == (depth, means[-1])
    assert len(set(means)) == 3


@pytest.mark.parametrize("level", WATERINGS)
def test_what_perfect_maturation_would_water(level: str) -> None:
    for depth, mean in enumerate(WATERINGS[level], start=1):
        (row,) = lookahead_waterings(level, "up-down", depth, 1000)
        assert row["waterings"] == pytest.approx(mean, abs=3 * hypot(row["error"], ERROR))
        assert row["bucket"] == 0
