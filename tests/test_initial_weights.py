"""Initial weights of trials: the shipped weights of their own world, or nothing."""

from __future__ import annotations

import pytest
import torch

from parenting.agent.init import world_of
from parenting.envs import registry
from parenting.experiments.figure3.levels import config_of
from parenting.experiments.training.gardens import garden
from parenting.weights.store import Wanted, initial_weights, pretrained, shipped


def test_the_shipped_weights_of_its_own_world_where_the_config_asks() -> None:
    asks, does_not = config_of(pretrain=True, recompare=False), config_of(pretrain=False, recompare=False)
    for world in (world_of("side-effects", "box", asks), garden("garden")):
        found = initial_weights(world, asks)
        assert found is not None
        assert torch.equal(found, shipped(Wanted(registry.spec(world.name), world.height, world.width)))
        assert torch.equal(found, pretrained(world))
        assert initial_weights(world, does_not) is None


def test_there_are_none_for_a_size_that_nobody_has_trained() -> None:
    config = config_of(pretrain=True, recompare=False)
    art = "world: side-effects\nname: wide\n\n#########\n# A X  G#\n#       #\n#########\n"
    with pytest.raises(ValueError, match="no pre-trained weights for side-effects at 4 x 9"):
        initial_weights(world_of("side-effects", art, config), config)
