"""The reference of pre-training on mazes that one can follow by eye."""

from __future__ import annotations

from math import log

import pytest
import torch

from parenting.agent.pretraining import ENTROPY
from parenting.envs import registry
from parenting.envs.rng import keys
from reference import pretraining as reference_pretraining
from reference.policy import Policy
from reference.pretraining import Maze, Visit, draw, loss, walk

UP, RIGHT = 0, 3
BOX = registry.make("side-effects")
LAND, GOAL = BOX.code(" "), BOX.code("G")
ROWS = ((0, 0, 0, 0, 0, 0), (0, LAND, LAND, LAND, GOAL, 0), *[(0,) * 6] * 4)
CORRIDOR = Maze(ROWS, start=(1, 1), goal=(1, 4))


@pytest.fixture
def policy() -> Policy:
    """Indifferent: all its weights are 0."""
    found = Policy(BOX, keys(0, 1))
    for part in found.parameters():
        part.data.zero_()
    return found


def test_an_indifferent_policy_takes_each_action_for_a_quarter_of_the_draws(policy: Policy) -> None:
    chances = reference_pretraining.chances_in(policy, CORRIDOR)
    assert chances == {(1, 1): [0.25] * 4, (1, 2): [0.25] * 4, (1, 3): [0.25] * 4}
    assert [draw([0.25] * 4, u) for u in (0.0, 0.24, 0.25, 0.5, 0.75, 0.99)] == [0, 0, 1, 2, 3, 3]


def test_a_walk_and_what_it_earns(policy: Policy) -> None:
    visits = walk(policy, CORRIDOR, [0.9, 0.1, 0.9, 0.9, 0.9])
    assert [visit.action for visit in visits] == [RIGHT, UP, RIGHT, RIGHT]  # the last draw is not used
    assert [visit.earned for visit in visits] == [46, 47, 48, 49]
    assert [visit.seen[1].index(policy.agent) for visit in visits] == [1, 2, 2, 3]
    assert [visit.earned for visit in walk(policy, CORRIDOR, [0.9, 0.1])] == [-2, -1]


def test_the_loss_by_hand(policy: Policy) -> None:
    seen = CORRIDOR.seen((1, 3), policy.agent)
    *_, bias = policy.near.parameters()
    bias.data.copy_(torch.tensor([0, 0, 0, 2 * log(3)]))  # the mean of two heads: pi is (1, 1, 1, 3) / 6
    value = loss(policy, [Visit(seen, RIGHT, 49.0), Visit(seen, UP, -1.0)])  # 1 and -1, normalised
    entropy = 3 * log(6) / 6 + log(2) / 2
    assert value.item() == pytest.approx((-log(1 / 2) + log(1 / 6)) / 2 - ENTROPY * entropy)
