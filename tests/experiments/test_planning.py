"""Planning and fitting by hand: a corridor, and a person whose reward is known (Sec. 4.2)."""

from __future__ import annotations

import torch

from envs import registry
from experiments.figure4 import LENGTH, rho, shift_some
from experiments.planning import Pairs, cross_entropy, fit, follow, plan, preferences, random_pairs
from parents.model import explore

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
    then = MODEL.then[pairs.at[:, :, :-1], pairs.action[:, :, :-1]]
    assert torch.equal(then, pairs.at[:, :, 1:])
    assert not bool(MODEL.over[pairs.at[:, :, 0]].any())


def test_a_fit_finds_the_differences_and_no_shift() -> None:
    pairs = random_pairs(MODEL, 4000, 3, torch.Generator().manual_seed(2))
    chance = preferences(pairs, TRUE)
    found = fit(pairs, chance, len(TRUE))
    assert torch.allclose(pairs.difference(found), pairs.difference(TRUE), atol=0.01)
    losses = [float(cross_entropy(pairs, chance, found + shift)) for shift in (0.0, -1.0, 5.0)]
    assert max(losses) - min(losses) < 1e-12
    assert abs(float(found.mean() - TRUE.mean())) < 1


def test_the_planner_turns_to_harm_at_a_shift_of_a_half() -> None:
    rows = [row for row in shift_some(0, 0) if row["of"] == "rho"]
    assert {
        row["shift"]: row["harms"] for row in rows if -1 <= row["shift"] <= 0 and row["shift"] != -0.5
    } == {shift / 8: shift < -4 for shift in range(-8, 1) if shift != -4}
