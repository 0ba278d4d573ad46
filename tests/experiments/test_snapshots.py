"""Policies on their way: at each milestone what a life of that length would have left."""

from __future__ import annotations

import pytest
import torch

from parenting.agent.config import compose
from parenting.envs import registry
from parenting.envs.rng import keys
from parenting.experiments.training.batch import train_agents
from parenting.experiments.training.gardens import garden
from parenting.experiments.training.snapshots import train_with_snapshots
from parenting.experiments.training.stop_rule import StopRule

CHANGES = {"pretrain": False, "time_limit": 10, "stages": 2, "mature_every": 8}
CONFIG = compose("conservative", registry.defaults("reward-hacking"), CHANGES, strict=True)


@pytest.mark.slow
def test_a_milestone_is_where_a_shorter_life_ends() -> None:
    world, mine = garden("garden"), keys(1, 4)
    first, last = (one.check() for one in train_with_snapshots(world, CONFIG, mine, (8, 16), 200))
    for passed, number in ((first, 8), (last, 16)):
        alone = train_agents(world, CONFIG, mine, StopRule("queries", number), max_ticks=200)
        assert bool(passed.there.all())
        assert torch.equal(passed.counts.ticks, alone.counts.ticks)
        assert torch.equal(passed.counts.guidance, alone.counts.guidance)
        place = alone.counts.maturity - 1
        # trials leave a shorter life's batch earlier, so the last bits may differ
        assert torch.allclose(passed.live, alone.policies[place, torch.arange(4)], atol=1e-5)


def test_who_does_not_come_so_far_is_not_there() -> None:
    first, last = train_with_snapshots(garden("garden"), CONFIG, keys(1, 2), (2, 16), 10)
    assert first.there.tolist() == [True, True]
    assert last.there.tolist() == [False, False]
    assert bool((last.counts.ticks == 10).all())
