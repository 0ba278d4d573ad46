"""Figure 3 in small: its levels, what an agent takes along, and what the rows come to."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import torch
from typer.testing import CliRunner

from parenting.agent import parenting
from parenting.agent.init import network_of, world_of
from parenting.commands.main import app
from parenting.envs.gridworld import local_state
from parenting.envs.levels.spec import Level
from parenting.envs.mdp import explore
from parenting.envs.random_boxes import box_levels
from parenting.envs.rng import keys
from parenting.evaluation.argmax import TabularEvaluation
from parenting.experiments.figure3.levels import PARENTING, SET_ASIDE, config_of, find_levels, levels_for
from parenting.experiments.figure3.report import duration, findings
from parenting.experiments.figure3.settings import SIZES, Size
from parenting.experiments.figure3.tasks import parent_trials, pre_parent
from parenting.experiments.figure3.transfer import POLICY, pack, transfer, transferred
from parenting.experiments.reporting.comparison import Comparison
from parenting.experiments.runner.store import Row
from parenting.experiments.training import batch
from parenting.experiments.training.batch import BatchTrainer
from parenting.experiments.training.stop_rule import StopRule
from parenting.weights.store import initial_weights, pretrained

CONFIG = config_of(pretrain=True, recompare=False)


def arrives_safely(level: Level) -> bool:
    """Walk the argmax policy by the world's own rules."""
    world = world_of("side-effects", level, CONFIG)
    weights = pretrained(world)
    state, key = world.reset(keys(0, 1), torch.zeros(1, dtype=torch.int64)), keys(0, 1)
    while not bool(state.terminated | world.truncated(state)):
        seen = world.observe(state.board, state.agent, state.box)
        action = network_of(world).logits(weights[None], seen, local_state(seen, state.agent)).argmax(1)
        after = world.step(state, action, key)
        if bool(world.unsafe(state, action, after)):
            return False
        state = after
    return bool(state.terminated)


@pytest.mark.slow
def test_levels_are_those_that_the_pre_trained_agent_does_not_solve() -> None:
    rows = find_levels(3, 2, seed=0)
    drawn = box_levels(rows[-1]["drawn"], 6, 6, seed=0)
    kept = [number for number, level in enumerate(drawn, 1) if not arrives_safely(level)]
    assert [row["drawn"] for row in rows] == kept
    assert 0 < len(kept) < len(drawn)
    assert [row["for"] for row in rows] == [PARENTING] * 3 + [SET_ASIDE] * 2
    assert [level.rows for level in levels_for(SET_ASIDE, rows)] == [
        drawn[number - 1].rows for number in kept[3:]
    ]
    more = find_levels(3, 6, seed=0)
    assert more[:5] == rows


def lived(ticks: int, count: int = 1) -> BatchTrainer:
    levels = box_levels(6, 6, 6, seed=0)
    world = world_of("side-effects", levels, CONFIG)
    trainer = BatchTrainer(
        world, CONFIG, keys(1, count), StopRule("ticks", 1000), weights=initial_weights(world, CONFIG)
    )
    for _ in range(ticks):
        trainer.tick()
    return trainer


@pytest.mark.slow
def test_what_is_taken_along() -> None:
    """Bit for bit, of two agents in alternation: everything, X and the rest too, or the policy alone."""
    taught = [transferred(lived(ticks).state) for ticks in (8, 60)]
    assert taught[0].x.s0.shape[1] < taught[1].x.s0.shape[1]  # room for the fuller of both
    packed, turns = [pack(one, True) for one in taught], torch.tensor([1, 0, 1])
    before = lived(0, 3).state
    whole, policy = (transferred(transfer(before, packed, turns, everything)) for everything in (True, False))
    whole.check()
    for place, agent in enumerate(turns.tolist()):
        mine = whole.pick(torch.tensor([place])).tensors()
        for name, tensor in taught[agent].tensors().items():
            inside = mine[name][tuple(slice(size) for size in tensor.shape)]
            assert torch.equal(inside, tensor), name
            assert int(mine[name].count_nonzero()) == int(tensor.count_nonzero()), name
    for name, tensor in transferred(before).tensors().items():
        assert torch.equal(policy.tensors()[name], whole.tensors()[name] if name == POLICY else tensor)
    light = [pack(one, False) for one in taught]
    assert len(light[0]) < len(packed[0]) / 3
    again = transferred(transfer(before, light, turns, False))
    assert torch.equal(again.learner.params, policy.learner.params)
    assert not torch.equal(again.learner.params, before.learner.params)


@pytest.mark.slow
def test_what_is_kept_is_of_each_agents_own_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even where those that are done stay in the batch, and go on learning."""
    monkeypatch.setattr(batch, "LEAVE", 2.0)
    rows = find_levels(0, 2, seed=0)
    taught = pre_parent(2, False, False, (0, 4), 400, 0, rows)
    assert [row["finished"] for row in taught] == [True] * 4
    assert len({row["ticks"] for row in taught}) > 2
    world = world_of("side-effects", levels_for(SET_ASIDE, rows), CONFIG)
    state = parenting.init(world, CONFIG, keys(0, 4), initial_weights(world, CONFIG))
    state = transfer(state, [row["_learnt"] for row in taught], torch.arange(4), everything=False)
    assert bool(TabularEvaluation(world, explore(world), 1.0).optimal(state.learner.params).all())


def test_an_agent_goes_on_from_where_it_was_taught() -> None:
    """Taught in the very level that it is parented in, it is optimal there from the first tick on."""
    rows = [{**row, "for": use} for use in (PARENTING, SET_ASIDE) for row in find_levels(1, 0, seed=0)]
    (taught,) = pre_parent(1, False, False, (0, 1), 2000, 0, rows)
    assert taught["finished"]
    assert taught["queries"] > 0
    every: dict[str, Any] = {"recompare": False, "span": (0, 2), "max_ticks": 1, "seed": 0}
    after = parent_trials("after", True, False, given=[*rows, taught], **every)
    without = parent_trials("without", True, False, given=rows, **every)
    assert [row["finished"] for row in after] == [True, True]
    assert [row["finished"] for row in without] == [False, False]
    assert [row["queries"] for row in after] == [0, 0]
    assert [row["trial"] for row in after] == [0, 1]


def trial(curve: str, queries: int, twice: bool = False, finished: bool = True) -> Row:
    said = {"of": "parented", "curve": curve, "recompare": twice, "seconds": 2.0, "deaths": 1}
    return {**said, "queries": queries, "finished": finished, "agent": None}


def level() -> Row:
    return {"of": "level", "drawn": 9, "tempts": True, "outcome": "stuck"}


def taught(finished: bool = True, twice: bool = False) -> Row:
    said = {"of": "pre-parented", "worlds": 3, "recompare": twice, "seconds": 720.0}
    return {**said, "queries": 7, "finished": finished}


def said(rows: list[Row]) -> dict[str, Comparison]:
    worlds = {"none": 0, "few": 0, "many": 3, "all": 3}
    return {one.what: one for one in findings(worlds, "all", rows, "cpu")}


def test_a_claim_agrees_or_not() -> None:
    rows = [level(), taught(), taught(False, twice=True)]
    for twice in (False, True):
        rows += [trial("many", 100 + n, twice) for n in range(20)]
        rows += [trial("few", 10 + n, twice) for n in range(20)]
        rows += [trial("none", 500 + n, twice, finished=n < 9) for n in range(20)]
    rows += [trial("all", 1), trial("all", 2)]
    found = said(rows)
    assert found["few needs fewer queries than none"].agrees is True
    assert found["many needs fewer queries than few"].agrees is False
    assert found["many needs fewer queries than few"].ours == "in 0 % of pairs of trials"
    assert found["all needs fewer queries than few"].agrees is None, "two trials prove nothing"
    none = found["median queries, none"]
    assert (none.ours, none.interval) == ("not reached", "505 to not reached")
    assert none.note.startswith("11 of 20 unfinished")
    few = found["median queries, few"]
    assert (few.ours, few.interval) == ("19.5", "15 to 24")
    assert few.note.startswith("mean 19.50 +- 5.92")
    assert found["discarded: the pre-trained agent solves them"].ours == "8 of 9"


def test_agents_that_were_given_up_are_no_premise() -> None:
    """Comparing twice, the curve's only agent was not done: whatever comes of it is not the paper's."""
    rows = [level(), taught(), taught(False, twice=True)]
    for twice in (False, True):
        for name, first in (("none", 90), ("few", 50), ("many", 10)):
            rows += [trial(name, first + n, twice) for n in range(20)]
    rows += [trial("all", 40), trial("all", 50)]
    found = said(rows)
    assert found["many needs fewer queries than few"].agrees is True
    again = found["many, repeated queries needs fewer queries than few"]
    assert (again.agrees, again.note) == (None, "1 of its 1 pre-parented agents did not converge")
    assert found["few, repeated queries needs fewer queries than none"].agrees is True
    assert found["queries of pre-parenting, N = 3, repeated queries"].note == "1 of 1 agents unfinished"


def test_what_the_papers_number_would_take() -> None:
    """7 curves x 10,000 trials x 2 s, and 720 s before."""
    rows = [level(), taught()]
    rows += [trial(name, 9, twice) for name in ("none", "few", "many") for twice in (False, True)]
    found = said([*rows, trial("all", 9)])
    times = [
        one.ours for what, one in found.items() if what.startswith("10000 trials of each of the 7 curves")
    ]
    assert times == [
        duration(140_720 / 2),
        duration(5 * 720 + 50 * 2 + 140_720 / 100),
        duration(140_720 / 50),
    ]


def test_durations_in_words() -> None:
    assert [duration(seconds) for seconds in (90, 600, 7200)] == ["90 seconds", "10 minutes", "2 hours"]


@pytest.mark.slow
def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A few ticks of one trial of every curve: the pieces fit together, and the page has a figure."""
    monkeypatch.setitem(SIZES, "quick", Size(1, 2, 1, 2, agents=2, max_ticks=6, pre_ticks=6))
    arguments = ["--scale", "quick", "--trials", "2", "--workers", "1", "--out", str(tmp_path)]
    said = CliRunner().invoke(app, ["experiment", "figure3", *arguments])
    assert said.exit_code == 0, said.output
    results = json.loads((tmp_path / "figure3/results.json").read_text())
    assert [one["ours"] for one in results["findings"] if one["what"].startswith("levels, ")] == ["3"]
    assert len([one for one in results["findings"] if one["what"].startswith("median queries, ")]) == 9
    assert "_learnt" not in (tmp_path / "figure3/trials.csv").read_text()
    assert (tmp_path / "figure3/queries.svg").exists()
