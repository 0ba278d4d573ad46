"""Chunks depend on the number of trials alone, and their standings add up."""

from __future__ import annotations

import pytest
import torch

from agent.config import compose
from envs import registry
from experiments.chunks import CHUNK, Plan, chunks, run
from experiments.trials import Standing, Until


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


def plan() -> Plan:
    world = "unsafe-exploration"
    config = compose("conservative", registry.defaults(world), {}, strict=False)
    return Plan(world, "island", config, 0, 6, Until("queries", 3), 1000)


@pytest.mark.parametrize("workers", [1, 2])
def test_progress_is_of_all_chunks(workers: int) -> None:
    told: list[Standing] = []
    ending = run(plan(), workers, told.append).check()
    assert bool(ending.tally.finished.all())
    assert told[-1].trials <= 6
    if workers == 1:  # processes are looked at now and then; here every tick is told
        assert told[-1] == Standing(6, int(ending.tally.ticks.max()), 18)
        assert [one.queries for one in told] == sorted(one.queries for one in told)


def test_bits_do_not_depend_on_the_number_of_workers() -> None:
    one, two = run(plan(), 1).tensors(), run(plan(), 2).tensors()
    assert all(torch.equal(one[name], two[name]) for name in one)
