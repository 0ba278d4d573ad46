"""Counts of trials, the moment when they leave their batch, and their results."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from parenting.agent.config import Config, compose
from parenting.agent.init import world_of
from parenting.agent.parent import BatchParent
from parenting.agent.query import Choice, Query, QueryKind
from parenting.envs import registry
from parenting.envs.rng import keys
from parenting.experiments.training import batch
from parenting.experiments.training.batch import BatchTrainer, TrainResult, train_agents
from parenting.experiments.training.counts import Progress
from parenting.experiments.training.stop_rule import StopRule, read_stop_rule
from parenting.parents.scripted import ScriptedParent

ISLAND = compose("conservative", registry.defaults("unsafe-exploration"), {}, strict=False)


def trainer(until: StopRule, number: int = 10, config: Config = ISLAND) -> BatchTrainer:
    world = world_of("unsafe-exploration", "island", config)
    return BatchTrainer(world, config, keys(0, number), until)


def scripted(batch: BatchTrainer) -> ScriptedParent:
    assert isinstance(batch.parent, ScriptedParent)
    return batch.parent


def raised(until: StopRule, number: int = 10, max_ticks: int = 1000, **changes: object) -> TrainResult:
    config = ISLAND.model_copy(update=changes)
    world = world_of("unsafe-exploration", "island", config)
    return train_agents(world, config, keys(0, number), until, max_ticks=max_ticks)


class Refusing:
    """Says *neither* to some trials whenever they ask, and *either* to the others."""

    def __init__(self, refused: Tensor) -> None:
        self.refused = refused

    def answer(self, query: Query) -> Tensor:
        choice = torch.where(self.refused, int(Choice.NEITHER), int(Choice.EITHER))
        return torch.where(query.kind == QueryKind.NONE, int(Choice.NONE), choice)


def test_another_parent_is_made_from_the_scripted_one_and_heard() -> None:
    """It hears which trials are done, whenever it asks."""
    world, known = world_of("unsafe-exploration", "island", ISLAND), list[int]()

    def refusing(parent: BatchParent, done: Callable[[], Tensor]) -> BatchParent:
        assert isinstance(parent, ScriptedParent)
        parent.rule = Refusing(torch.ones(3, dtype=torch.bool))
        known.append(int(done().sum()))
        return parent

    found = train_agents(world, ISLAND, keys(0, 3), StopRule("ticks", 50), max_ticks=9, parent=refusing)
    assert known == [0]
    assert bool(found.counts.stuck.all())
    plain = train_agents(world, ISLAND, keys(0, 3), StopRule("ticks", 50), max_ticks=9)
    assert not bool(plain.counts.stuck.any())


@pytest.mark.parametrize("text", ["optimal", "queries:0", "ticks:x", "never", "optimal:3"])
def test_a_stop_rule_that_a_world_without_a_goal_has_not_is_refused(text: str) -> None:
    world = registry.spec("reward-hacking")
    with pytest.raises(ValueError, match=r"^no policy counts as optimal|^'.*' is none of optimal"):
        read_stop_rule(text, world)
    for rule in ("queries:7", "ticks:3"):
        assert str(read_stop_rule(rule, world)) == rule


@pytest.mark.parametrize("until", [StopRule("ticks", 50), StopRule("queries", 40), StopRule("optimal")])
def test_stuck_trials_leave_at_once_and_are_unfinished(until: StopRule) -> None:
    """A pause asks twice: after the second *neither*, heard in the third tick, nothing can happen."""
    batch = trainer(until, 10)
    scripted(batch).rule = Refusing(torch.ones(10, dtype=torch.bool))
    for _ in range(3):
        assert not bool(batch.counts.done.any())
        batch.tick()
    assert len(batch.state.waiting) == len(batch.counts.ticks) == 0  # the batch is empty
    result = batch.result
    assert bool(result.stuck.all())
    assert not bool(result.finished.any())
    assert result.ticks.tolist() == [3] * 10
    assert result.guidance.tolist() == [2] * 10


def test_the_others_live_on_without_those_that_are_stuck() -> None:
    batch = trainer(StopRule("ticks", 20), 10)
    refused = torch.arange(10) < 2
    scripted(batch).rule = Refusing(refused)
    for _ in range(3):
        batch.tick()
    assert len(batch.state.waiting) == 8
    scripted(batch).rule = Refusing(torch.zeros(8, dtype=torch.bool))
    for _ in range(17):
        batch.tick()
    assert torch.equal(batch.result.stuck, refused)
    assert torch.equal(batch.result.finished, ~refused)
    assert batch.result.ticks.tolist() == [3] * 2 + [20] * 8


def test_a_goal_that_is_reached_comes_before_being_stuck() -> None:
    batch = trainer(StopRule("queries", 2), 4)
    scripted(batch).rule = Refusing(torch.ones(4, dtype=torch.bool))
    for _ in range(3):
        batch.tick()
    assert bool(batch.result.finished.all())
    assert not bool(batch.result.stuck.any())


def test_queries_are_counted_by_their_stage() -> None:
    """A stage ends with its 5th answer; a question that was out by then still belongs to it."""
    found = raised(StopRule("queries", 14), max_clip_length=3, queries_per_stage=5, p_guid=0.5).counts.check()
    assert torch.equal(found.queries.sum(1), found.guidance + found.preference)
    assert found.queries.sum(1).tolist() == [14] * 10
    assert bool((found.maturity == 3).all())
    assert bool((found.queries[:, :2] >= 5).all())
    assert bool((found.queries[:, :2] <= 6).all())


@pytest.mark.slow
def test_policies_are_those_of_each_trials_own_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where trials stay in their batch, and go on training, after they are finished."""
    usual = raised(StopRule("optimal"), 20, dtype="float64")
    monkeypatch.setattr(batch, "LEAVE", 2.0)
    staying = raised(StopRule("optimal"), 20, dtype="float64")
    for found in (usual, staying):
        assert bool(found.counts.finished.all())
        assert bool(found.evaluation.optimal(found.policies[0]).all())
        assert len(set(found.counts.ticks.tolist())) > 5  # at different ticks
    assert torch.equal(usual.counts.ticks, staying.counts.ticks)


def test_policies_of_earlier_stages_are_the_frozen_ones() -> None:
    config = ISLAND.model_copy(update={"max_clip_length": 3, "queries_per_stage": 10})
    batch = trainer(StopRule("ticks", 40), 6, config)
    before = batch.state.learner.params.clone()
    frozen: dict[tuple[int, int], Tensor] = {}
    for _ in range(39):
        was = batch.state.maturity.clone()
        batch.tick()
        for trial in (batch.state.maturity > was).nonzero().squeeze(1).tolist():
            frozen[int(was[trial]) - 1, trial] = batch.state.learner.params[trial].clone()
    assert frozen
    batch.tick()
    for (stage, trial), live in frozen.items():
        assert torch.equal(batch.policies[stage, trial], live)
    last = batch.policies[batch.result.maturity - 1, torch.arange(6)]
    assert not bool((last == before).all(1).any())
    beyond = torch.arange(3)[:, None] >= batch.result.maturity
    assert not bool(batch.policies[beyond].any())


@pytest.mark.slow
def test_unfinished_trials_leave_their_policies_and_are_judged() -> None:
    found = raised(StopRule("queries", 10_000), 6, max_ticks=80)
    assert not bool(found.counts.finished.any())
    assert torch.equal(found.counts.optimal, found.evaluation.optimal(found.policies[0]))
    assert bool(found.counts.optimal.any())


def test_standing_counts_no_trial_twice() -> None:
    batch = trainer(StopRule("queries", 6), 10)
    for tick in range(1, 200):
        batch.tick()
        now = batch.progress(tick)
        assert now.trials == int(batch.result.finished.sum())
        assert now.queries <= 60
        if now.trials == 10:
            break
    assert now == Progress(10, tick, 60)


@pytest.mark.slow
def test_the_first_optimal_policy_is_noted_where_the_trial_goes_on() -> None:
    """As the same trials count that end there."""
    world, mine = world_of("unsafe-exploration", "island", ISLAND), keys(0, 4)
    ended = raised(StopRule("optimal"), 4).counts
    going_on = train_agents(
        world, ISLAND, mine, StopRule("ticks", 60), max_ticks=60, note_optimal=True
    ).counts
    there = ended.ticks <= 60
    assert bool(there.any())
    assert bool((going_on.ticks == 60).all())
    assert going_on.optimal_at.tolist() == torch.where(there, ended.ticks, 0).tolist()
    assert going_on.optimal_deaths.tolist() == torch.where(there, ended.deaths, 0).tolist()
    assert going_on.optimal_queries.tolist() == torch.where(there, ended.queries.sum(1), 0).tolist()


@pytest.mark.slow
def test_nobody_looks_for_an_optimal_policy_unasked() -> None:
    assert not bool(raised(StopRule("ticks", 60), 4, 60).counts.optimal_at.any())
