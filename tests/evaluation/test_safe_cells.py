"""The cells from which a policy reaches the goal safely, held against walks through the model, one by one."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from parenting.agent.init import network_of
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.envs.mdp import explore
from parenting.envs.rng import keys
from parenting.evaluation.argmax import ArgmaxPolicy, TabularEvaluation
from parenting.evaluation.outcomes import UNREACHABLE, Outcome, follow, outcome
from parenting.evaluation.safe_cells import SafeCells
from tests.evaluation.test_argmax import trained

WORLDS = ("unsafe-exploration", "side-effects", "interruptibility", "absent-supervisor")


def random(world: Gridworld, trials: int) -> Tensor:
    return network_of(world).init_params(keys(3, trials), torch.float64)


def walked(evaluation: TabularEvaluation, row: Tensor, cells: Tensor) -> int:
    """The cells from which the policy's own walk ends at the goal, with no forbidden step on the way."""
    model, many = evaluation.model, row.expand(len(cells), -1)
    path = follow(model, ArgmaxPolicy(evaluation, many), cells, len(model.terminal))
    return int((outcome(model, evaluation.distance, path) <= Outcome.DETOUR).sum())


@pytest.mark.parametrize("name", WORLDS)
def test_random_policies_against_their_walks(name: str) -> None:
    world = registry.make(name, None, time_limit=100)
    evaluation = TabularEvaluation(world, explore(world), 0.9)
    safe = SafeCells(evaluation)
    assert bool((evaluation.distance[safe.cells] < UNREACHABLE).all())
    found = [safe.count(row[None]) for row in random(world, 6)]
    assert found == [walked(evaluation, row[None], safe.cells) for row in random(world, 6)]


def test_trained_policies_reach_the_goal_from_more_cells_and_the_optimal_from_its_start() -> None:
    world = registry.make("unsafe-exploration", "island", time_limit=100)
    evaluation = TabularEvaluation(world, explore(world), 0.9)
    safe = SafeCells(evaluation)
    found = [safe.count(row[None]) for row in trained("island")]
    assert found == [walked(evaluation, row[None], safe.cells) for row in trained("island")]
    before = [safe.count(row[None]) for row in random(world, 20)]
    assert sum(found) > sum(before)
    optimal = evaluation.optimal(trained("island"))
    assert bool(optimal.any())
    assert all(count > 0 for count, best in zip(found, optimal.tolist(), strict=True) if best)


def test_a_large_level_has_at_most_so_many_cells_spread_over_it() -> None:
    world = registry.make("unsafe-exploration", "island", time_limit=100)
    evaluation = TabularEvaluation(world, explore(world), 0.9)
    every, few = SafeCells(evaluation).cells, SafeCells(evaluation, most=5).cells
    assert len(few) <= 5
    assert few[0] == every[0]
    assert int(few[-1]) > len(every) // 2
