"""The history of trials: what was counted, after ticks that are evenly spread, with the last row exact."""

from __future__ import annotations

import time
from itertools import pairwise

import pytest
import torch

from parenting.agent.config import compose
from parenting.envs import registry
from parenting.evaluation.argmax import TabularEvaluation
from parenting.experiments.training import history
from parenting.experiments.training.chunks import TrainPlan, train_in_chunks
from parenting.experiments.training.history import metrics
from parenting.experiments.training.stop_rule import StopRule


def plan(number: int, kept: bool = True) -> TrainPlan:
    world = "unsafe-exploration"
    config = compose("lax", registry.defaults(world), {"pretrain": False}, strict=False)
    return TrainPlan(
        world, registry.level(world).text, config, 3, 3, StopRule("queries", number), 400, history=kept
    )


@pytest.mark.slow
def test_rows_grow_with_the_life_and_end_with_its_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(history, "ROWS", 8)
    found = train_in_chunks(plan(20), 1).check()
    for trial in range(3):
        rows = metrics(found.history[trial])
        ticks = sorted(rows)
        last = rows[ticks[-1]]
        assert 4 <= len(ticks) <= 9
        assert ticks[-1] == int(found.counts.ticks[trial])
        assert len({b - a for a, b in pairwise(ticks[:-1])}) == 1, "evenly spread"
        for name in ("deaths", "guidance", "preference"):
            counted = [rows[tick][name] for tick in ticks]
            assert counted == sorted(counted)
            assert last[name] == int(getattr(found.counts, name)[trial])
        chosen = [last[name] for name in ("left", "right", "either", "neither")]
        assert sum(chosen) == last["guidance"] + last["preference"] > 0
        assert max(chosen) < sum(chosen), "of several kinds"
        assert last["skips"] == 0
        assert last["optimal"] == int(found.counts.optimal[trial])
        assert last["loss"] > 0
        assert [rows[tick]["seconds"] for tick in ticks] == sorted(rows[tick]["seconds"] for tick in ticks)
        assert isinstance(last["return"], float)
    assert rows[1]["loss"] is None, "nothing is learnt in the first tick"


@pytest.mark.slow
def test_a_history_changes_no_trial() -> None:
    with_it, without = train_in_chunks(plan(6), 1), train_in_chunks(plan(6, kept=False), 1)
    assert without.history.shape[1] == 0
    named = without.replace(history=with_it.history).tensors()
    assert all(
        torch.equal(named[name], tensor) for name, tensor in with_it.tensors().items() if name != "history"
    )


@pytest.mark.slow
@pytest.mark.parametrize(("rest", "most"), [(3600.0, 1), (1e-9, 99)])
def test_where_a_return_takes_episodes_it_is_measured_now_and_then(
    monkeypatch: pytest.MonkeyPatch, rest: float, most: int
) -> None:
    monkeypatch.setattr(TabularEvaluation, "refresh_seconds", rest)  # as in the garden
    monkeypatch.setattr(history, "MEASURING", 1e9)
    rows = metrics(train_in_chunks(plan(20), 1).history[0])
    measured = [row["return"] for _, row in sorted(rows.items()) if row["return"] is not None]
    assert min(most, len(rows)) == len(measured)


def test_a_measurement_that_takes_long_is_seldom_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that takes a second is not made again within twenty."""
    times = iter((0.0, 100.0, 101.0, 120.0, 122.0, 123.0))
    monkeypatch.setattr(time, "monotonic", lambda: next(times))
    monkeypatch.setattr(TabularEvaluation, "refresh_seconds", 3.0)
    monkeypatch.setattr(TabularEvaluation, "returns", lambda *_: torch.ones(1, dtype=torch.float64))
    kept = history.History(1, TabularEvaluation.__new__(TabularEvaluation))
    found = [float(kept._returns(torch.zeros(1, 1))) for _ in range(3)]
    assert [value == 1 for value in found] == [True, False, True]
