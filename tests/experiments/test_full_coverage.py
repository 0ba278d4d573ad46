"""The coverage agent: its clips, the answers about them, and that X comes to hold the states it reaches."""

from __future__ import annotations

from typing import Any

import pytest
import torch
from torch import Tensor

from parenting.agent.config import compose
from parenting.envs import registry
from parenting.envs.gridworld import WorldState
from parenting.envs.reward_hacking import RewardHacking
from parenting.envs.rng import keys
from parenting.experiments.figure2 import full_coverage
from parenting.experiments.figure2.all_pairs import PAIRS, clip, compare, pair_answers
from parenting.experiments.figure2.full_coverage import Dataset, VisitedStates, cover, first_of, visit
from parenting.experiments.figure2.settings import Budget
from parenting.experiments.training.gardens import GAMMA, garden
from parenting.parents.garden_values import GardenValues
from parenting.parents.scripted import ScriptedRule
from tests.parents.fixed_policies import DOWN, LEFT, RIGHT, always

CHANGES = {"pretrain": False, "time_limit": 10}
CONFIG = compose("conservative", registry.defaults("reward-hacking"), CHANGES, strict=True)


def test_clips_go_on_by_the_frozen_policies_the_latest_first() -> None:
    world = garden("garden-mirrored")
    start = world.beginnings()
    found = clip(world, start, DOWN, [always(world, LEFT), always(world, RIGHT)])
    assert found.action.tolist() == [[DOWN, RIGHT, LEFT]]
    row, column = start.agent[0].tolist()
    assert found.agent[0].tolist() == [
        [row, column],
        [row + 1, column],
        [row + 1, column + 1],
        [row + 1, column],
    ]


def test_every_pair_is_judged_by_its_advantage() -> None:
    """Of single moves the parent prefers the greater Q_p and shuns the bucket, on whichever side it is."""
    world = garden("garden-mirrored")
    valued, rule = GardenValues(world, GAMMA), ScriptedRule(world, GAMMA)
    states = visit(world, always(world, LEFT), 60, keys(0, 1), epsilon=0.9).states
    mu = pair_answers(world, rule, states, [])
    every = [torch.full_like(states.step_count, action) for action in range(4)]
    q = torch.stack([valued.q(states.board, states.agent, states.level, action) for action in every], 1)
    wet = torch.stack([world.unsafe(states, action, world.forecast(states, action)) for action in every], 1)
    assert bool(wet.any())
    q = q.masked_fill(wet, -1.0)  # what ends in the bucket loses, and of two such neither
    for place, (one, other) in enumerate(PAIRS):
        better = (q[:, one] - q[:, other]).masked_fill((q[:, one] - q[:, other]).abs() < 1e-6, 0).sign()
        assert torch.equal(mu[:, place, 0] - mu[:, place, 1], better)
    left, right = (clip(world, states, action, []) for action in (LEFT, RIGHT))
    choices = [rule.answer(compare(world, states, *pair)) for pair in ((left, right), (right, left))]
    swapped = torch.tensor([0, 2, 1, 3, 4])
    assert torch.equal(swapped[choices[0]], choices[1])


def test_what_looks_alike_is_one_row_in_proportion_to_visits() -> None:
    world = garden("garden-mirrored")
    start = world.beginnings()
    two = start.pick(torch.tensor([0, 0]))
    seen = world.observe(two.board, two.agent, two.box)
    visited = VisitedStates(
        two, seen, torch.tensor([1, 2]), torch.tensor([7, 7]), torch.tensor([3, 1])
    ).check()
    mu = torch.zeros(2, 6, 2, dtype=torch.float64)
    mu[0, :, 0] = 1
    mu[1, :, 1] = 1
    x = Dataset(world)
    x.add(visited, mu)
    assert x.truth.tolist() == [1, 2]
    assert x.sight.tolist() == [7]
    assert x.rows(torch.tensor([0])).mu.tolist() == [[[0.75, 0.25]] * 6]
    assert first_of(torch.tensor([5, 3, 5, 3, 9])).tolist() == [0, 1, 4]


@pytest.mark.slow
def test_x_comes_to_hold_what_it_reaches(monkeypatch: pytest.MonkeyPatch) -> None:
    """And it is asked about all six pairs of moves in each true state once, however often it comes there."""
    world = garden("garden-mirrored")
    compared: list[set[tuple[int, ...]]] = [set(), set()]
    seen: list[set[tuple[int, ...]]] = [set(), set()]

    def note(world: RewardHacking, rule: ScriptedRule, states: WorldState, frozen: Any) -> Tensor:
        true = zip(states.board.flatten(1).tolist(), states.agent.tolist(), strict=True)
        compared[len(frozen)] |= {(*board, *agent) for board, agent in true}
        sight = world.observe(states.board, states.agent, states.box)
        seen[len(frozen)] |= set(map(tuple, sight.flatten(1).tolist()))
        return pair_answers(world, rule, states, frozen)

    monkeypatch.setattr(full_coverage, "pair_answers", note)
    stages = cover(world, CONFIG.model_copy(update={"learning_rate": 0.003}), keys(0, 1), 2, Budget(4, 5, 20))
    for stage, one in enumerate(stages):
        assert one.known > 0.7 * one.reached
        assert (one.questions, one.states) == (6 * len(compared[stage]), len(seen[stage]))
    assert not torch.equal(stages[0].live, stages[1].live)
