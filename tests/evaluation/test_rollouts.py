"""Waterings of policies whose way is plain to see, counted by hand; means of drying against its chance."""

from __future__ import annotations

import pytest
import torch

from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.evaluation import rollouts
from parenting.evaluation.rollouts import deploy
from tests.parents.fixed_policies import DOWN, LEFT, UP, always, at_a_wall


def garden(drying: float, steps: int = 10, level: str = "garden-mirrored") -> Gridworld:
    return registry.make("reward-hacking", level, time_limit=steps, drying=drying)


@pytest.mark.parametrize(
    ("action", "drying", "watered"),
    [
        (DOWN, 0.0, 1),  # two steps to a dry plant, which never dries again
        (DOWN, 1.0, 9),  # it is dry again after each step on it: the 2nd to the 10th
        (UP, 0.0, 0),  # one step to a plant that is watered
        (UP, 1.0, 9),  # it dries in the 1st step: the 2nd to the 10th
        (LEFT, 1.0, 0),  # a row without plants
    ],
)
def test_one_way_by_hand(action: int, drying: float, watered: int) -> None:
    world = garden(drying)
    found = deploy(world, always(world, action), episodes=7).check()
    assert (found.waterings.tolist(), found.bucket.tolist()) == ([[watered] * 7], [[0] * 7])


def test_steps_in_the_bucket() -> None:
    """Left to the wall (4 steps), then up to the bucket (2), and there it stays: the 6th to the 10th step."""
    world = garden(0.05)
    found = deploy(world, at_a_wall(world, LEFT, UP), episodes=7)
    assert found.bucket.tolist() == [[5] * 7]
    assert found.waterings.tolist() == [[0] * 7]
    assert found.in_bucket_at_end.tolist() == [[True] * 7]


def test_policies_side_by_side() -> None:
    world = garden(1.0)
    every = torch.cat([always(world, UP), at_a_wall(world, LEFT, UP), always(world, DOWN)])
    found = deploy(world, every, episodes=3)
    assert found.waterings.tolist() == [[9] * 3, [0] * 3, [9] * 3]
    assert found.bucket.tolist() == [[0] * 3, [5] * 3, [0] * 3]
    assert found.in_bucket_at_end.tolist() == [[False] * 3, [True] * 3, [False] * 3]


def test_trials_walk_alike_in_whatever_company(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every policy meets the same randomness, whatever the size of the batch."""
    world = garden(0.05)
    one, many = always(world, DOWN), always(world, DOWN).repeat(5, 1)
    alone = deploy(world, one, episodes=40)
    assert torch.equal(deploy(world, many, episodes=40).waterings, alone.waterings.repeat(5, 1))
    monkeypatch.setattr(rollouts, "MAX_BATCH", 80)
    assert torch.equal(deploy(world, many, episodes=40).waterings, alone.waterings.repeat(5, 1))


def test_the_randomness_of_few_episodes_is_that_of_the_first_of_many() -> None:
    world = garden(0.05)
    few, many, other = (
        deploy(world, always(world, DOWN), episodes, env_seed=seed).waterings
        for episodes, seed in ((40, 0), (90, 0), (40, 1))
    )
    assert torch.equal(few, many[:, :40])
    assert not torch.equal(few, other)


def test_mean_is_that_of_the_chance_to_dry() -> None:
    """On the dry plant from the 2nd step on: 1, and 0.05 for each of 8 more steps.

    The plant's dryings are independent, so the mean of 1000 episodes has a standard error of
    sqrt(8 * 0.05 * 0.95 / 1000) = 0.02.
    """
    world = garden(0.05)
    mean = float(deploy(world, always(world, DOWN)).waterings.mean())
    assert mean == pytest.approx(1.4, abs=0.08)
    assert mean != 1.4  # a sample, after all
