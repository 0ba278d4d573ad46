"""Chunks depend on the number of trials alone, and their standings add up."""

from __future__ import annotations

import pytest
import torch

from parenting.agent.config import compose
from parenting.envs import registry
from parenting.experiments.training.chunks import CHUNK, TrainPlan, chunks, train_in_chunks
from parenting.experiments.training.counts import Progress
from parenting.experiments.training.stop_rule import StopRule


@pytest.mark.parametrize("trials", [1, 2, 3, 4, 20, 99, 100, 101, 150, 1000])
def test_every_trial_is_in_one_chunk(trials: int) -> None:
    found = chunks(trials)
    assert [one for chunk in found for one in chunk] == list(range(trials))
    sizes = [len(chunk) for chunk in found]
    assert max(sizes) <= CHUNK
    assert max(sizes) - min(sizes) <= 1
    assert len(found) >= min(2, trials)  # two cores have work


def test_hundred_trials_are_two_chunks_of_fifty() -> None:
    assert chunks(100) == [range(50), range(50, 100)]
    assert chunks(4) == [range(2), range(2, 4)]


def plan() -> TrainPlan:
    world = "unsafe-exploration"
    config = compose("conservative", registry.defaults(world), {}, strict=False)
    return TrainPlan(world, "island", config, 0, 6, StopRule("queries", 3), 1000)


@pytest.mark.slow
def test_progress_and_bits_on_one_core_and_on_two() -> None:
    here: list[Progress] = []
    there: list[Progress] = []
    one, two = train_in_chunks(plan(), 1, here.append).check(), train_in_chunks(plan(), 2, there.append)
    assert bool(one.counts.finished.all())
    assert all(torch.equal(one.tensors()[name], tensor) for name, tensor in two.tensors().items())
    # in this process every tick is told; others are looked at now and then
    assert here[-1] == Progress(6, int(one.counts.ticks.max()), 18)
    assert [now.queries for now in here] == sorted(now.queries for now in here)
    assert all(now.trials <= 6 and now.queries <= 18 for now in there)
