"""Policy gradients in a garden: returns by hand, episodes as the world has them, and that they learn."""

from __future__ import annotations

import pytest
import torch

from parenting.agent.init import network_of
from parenting.agent.pretraining_mazes import EPISODES
from parenting.envs.rng import keys
from parenting.evaluation.rollouts import deploy
from parenting.experiments.baselines.reinforce_rollouts import advantages, rollout, train_gardeners, visits_of
from parenting.experiments.training.gardens import GAMMA, garden


def test_advantages_by_hand() -> None:
    """Rewards 0, 1 and 1, 0 at gamma 0.5: returns 0.5, 1 and 1, 0; means 0.75 and 0.5."""
    reward = torch.tensor([[[0.0, 1.0], [1.0, 0.0]]], dtype=torch.float64)
    centred = torch.tensor([[[-0.25, 0.25], [0.5, -0.5]]], dtype=torch.float64)
    assert torch.allclose(advantages(reward, 0.5), centred / (0.15625**0.5))


def test_a_trial_does_not_depend_on_its_neighbours() -> None:
    world = garden("garden", bucket=False)
    network = network_of(world)
    many = rollout(world, network, network.init_params(keys(3, 3), torch.float64), keys(3, 3 * EPISODES))
    alone = rollout(world, network, network.init_params(keys(3, 1), torch.float64), keys(3, EPISODES))
    assert torch.equal(many.action[:1], alone.action)
    assert torch.equal(many.seen[:1], alone.seen)
    assert many.reward.shape == (3, 10, EPISODES)


def test_every_step_has_its_share() -> None:
    world = garden("garden", bucket=False)
    network = network_of(world)
    found = rollout(world, network, network.init_params(keys(3, 2), torch.float32), keys(3, 2 * EPISODES))
    visits = visits_of(found, GAMMA, torch.float32)
    assert torch.allclose(visits.share.sum(1), torch.ones(2))
    taken = visits.worth.gather(2, found.action[:, :, None]).squeeze(2)
    assert torch.equal(taken, visits.worth.sum(2))


@pytest.mark.slow
def test_they_learn_to_water() -> None:
    world = garden("garden-mirrored", bucket=False)
    first, last = train_gardeners(world, GAMMA, 1, 2, (1, 80))
    before, after = (deploy(world, live, 100).waterings.mean() for live in (first, last))
    assert float(after) > float(before) + 1
