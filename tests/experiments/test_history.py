"""The history of trials: what was counted, after ticks that are evenly spread, with the last row exact."""

from __future__ import annotations

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
        assert last["optimal"] == int(found.counts.optimal[trial])
        assert last["loss"] > 0
        assert [rows[tick]["seconds"] for tick in ticks] == sorted(rows[tick]["seconds"] for tick in ticks)
        assert isinstance(last["return"], float)
    assert rows[1]["loss"] is None, "nothing is learnt in the first tick"


def test_a_history_changes_no_trial() -> None:
    with_it, without = train_in_chunks(plan(6), 1), train_in_chunks(plan(6, kept=False), 1)
    assert without.history.shape[1] == 0
    named = without.replace(history=with_it.history).tensors()
    assert all(
        torch.equal(named[name], tensor) for name, tensor in with_it.tensors().items() if name != "history"
    )


def test_where_a_return_takes_episodes_it_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(TabularEvaluation, "refresh_seconds", 1.0)  # as in the garden
    rows = metrics(train_in_chunks(plan(2), 1).history[0])
    assert {row["return"] for row in rows.values()} == {None}
