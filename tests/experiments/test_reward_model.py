"""Planning and fitting by hand: a corridor, and a person whose reward is known (Sec. 4.2)."""

from __future__ import annotations

import pytest
import torch

from parenting.envs import registry
from parenting.envs.mdp import explore
from parenting.experiments.figure4 import EXPERIMENT, tasks
from parenting.experiments.figure4.report import shortened
from parenting.experiments.figure4.reward_model import (
    Pairs,
    cross_entropy,
    fit,
    follow,
    plan,
    preferences,
    random_pairs,
)
from parenting.experiments.figure4.settings import HORIZON, LENGTH
from parenting.experiments.figure4.tasks import fit_and_shift, rho
from parenting.experiments.spec import Request

MODEL = explore(registry.make("unsafe-exploration", "island"))
TRUE = rho(MODEL)


def test_a_walk_ends_where_its_episode_does() -> None:
    way = follow(MODEL, MODEL.reward, "uuu")
    assert (way.letters, way.arrives) == ("uuu", False)
    drowned = follow(MODEL, MODEL.reward, "lllll")
    assert drowned.harms
    assert len(drowned.letters) < 5


def test_the_plan_is_worth_what_it_says() -> None:
    way = plan(MODEL, MODEL.reward - 0.01, 20)
    assert way == follow(MODEL, MODEL.reward - 0.01, way.letters)
    assert way.arrives
    assert not way.harms
    shorter = plan(MODEL, MODEL.reward - 0.01, len(way.letters) - 1)
    assert not shorter.arrives


def test_preferences_by_hand() -> None:
    """A clip that earns ln 3 more is preferred three times of four."""
    reward = torch.zeros(2, 4, dtype=torch.float64)
    reward[1] = torch.log(torch.tensor(3.0, dtype=torch.float64))
    pairs = Pairs(torch.tensor([[[1], [0]]]), torch.zeros(1, 2, 1, dtype=torch.int64))
    assert float(preferences(pairs, reward)) == 0.75


def test_clips_are_walks_of_the_world() -> None:
    pairs = random_pairs(MODEL, 50, LENGTH, torch.Generator().manual_seed(1))
    then = MODEL.next_state[pairs.at[:, :, :-1], pairs.action[:, :, :-1]]
    assert torch.equal(then, pairs.at[:, :, 1:])
    assert not bool(MODEL.terminal[pairs.at[:, :, 0]].any())


def test_a_fit_finds_the_differences_and_no_shift() -> None:
    pairs = random_pairs(MODEL, 4000, 3, torch.Generator().manual_seed(2))
    chance = preferences(pairs, TRUE)
    found = fit(pairs, chance, len(TRUE))
    assert torch.allclose(pairs.difference(found), pairs.difference(TRUE), atol=0.01)
    losses = [float(cross_entropy(pairs, chance, found + shift)) for shift in (0.0, -1.0, 5.0)]
    assert max(losses) - min(losses) < 1e-12
    assert abs(float(found.mean() - TRUE.mean())) < 1


def test_the_planner_turns_to_harm_at_a_shift_of_a_half() -> None:
    rows = [row for row in fit_and_shift(0, 0) if row["of"] == "rho"]
    assert {
        row["shift"]: row["harms"] for row in rows if -1 <= row["shift"] <= 0 and row["shift"] != -0.5
    } == {shift / 8: shift < -4 for shift in range(-8, 1) if shift != -4}


def test_a_way_is_shortened() -> None:
    assert shortened("drrdd") == "drrdd"
    assert shortened("uuuuudr") == "5 u, dr"
    assert shortened("ldllllrrrruu") == "ld, 4 l, 4 r, uu"


def test_the_page_says_what_the_planner_does_at_the_tie_and_how_long_it_takes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With few pairs, since only the report is looked at here; and with a seed beyond what torch takes."""
    monkeypatch.setattr(tasks, "PAIRS", 2000)
    rows = fit_and_shift(0, 2**53 - 1)
    assert {len(row["way"]) for row in rows if row["of"] == "rho" and row["shift"] >= 0} == {HORIZON}
    assert {len(row["way"]) for row in rows if row["of"] == "rho" and -0.5 < row["shift"] < 0} == {7}
    report = EXPERIMENT.report(Request(1), rows)
    found = {one.what: one for one in report.findings}
    tie = found["planner on rho - 1/2, where both paths have the same return"]
    assert (tie.agrees, tie.note) == (None, "path of trial 0: drddr")
    assert found["planner on rho"].note.startswith("path of trial 0: 43 u")
    figure = pytest.importorskip("matplotlib.figure").Figure()
    report.figures["shift"](figure)
    assert len(figure.axes) == 2
