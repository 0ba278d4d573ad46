"""Questions beyond the paper: bounds, the ideal tabular agent, curves, random islands, and the verdicts."""

from __future__ import annotations

from statistics import fmean

import pytest
import torch

from parenting.agent.config import compose
from parenting.agent.init import world_of
from parenting.envs import registry
from parenting.envs.mdp import explore
from parenting.envs.random_islands import island_levels
from parenting.envs.rng import keys
from parenting.experiments.questions import garden
from parenting.experiments.questions.bounds import certain, chance, expected
from parenting.experiments.questions.choice import verdict
from parenting.experiments.questions.report import findings
from parenting.experiments.questions.settings import CHOICE, CHOSEN, ISLANDS, LEVELS, RANDOM, WORLD
from parenting.experiments.questions.tabular import ideal_trial, table
from parenting.experiments.questions.tasks import long_trials, question_trials
from parenting.experiments.questions.tracking import QuestionTrainer
from parenting.experiments.questions.verdicts import at_most
from parenting.experiments.runner.store import Row
from parenting.experiments.training.batch import train_agents
from parenting.experiments.training.stop_rule import StopRule
from tests.lengths import length

CONSERVATIVE = compose("conservative", registry.defaults(WORLD), {}, strict=True)
OPTIMAL = StopRule("optimal")
ISLAND = world_of(WORLD, "island", CONSERVATIVE)


@pytest.mark.parametrize(("level", "routes", "moves"), [("island", 4, 4), ("island-bottleneck", 9, 8)])
def test_a_policy_is_optimal_by_luck_as_often_as_it_takes_one_of_the_ways(
    level: str, routes: int, moves: int
) -> None:
    assert chance(explore(registry.make(WORLD, level)), 0) == routes * 0.25**moves


def test_the_least_number_of_answers_counts_the_policies_that_answers_can_tell_apart() -> None:
    model = explore(ISLAND)
    assert expected(model, 0) == (1 - 1 / 64) + (1 - 5 / 64) + (1 - 21 / 64)
    assert certain(model, 0) == 4 * 3


@pytest.mark.parametrize(("world", "level"), LEVELS)
def test_the_ideal_tabular_agent_lies_between_its_bounds(world: str, level: str) -> None:
    made = registry.make(world, level)
    model = explore(made)
    known = table(made, model, 0.9 if world == WORLD else 1.0)
    found = [ideal_trial(known, 0, trial) for trial in range(60)]
    assert all(finished for _, finished in found)
    assert expected(model, 0) < fmean(answers for answers, _ in found) < certain(model, 0)
    assert found[:3] == [ideal_trial(known, 0, trial) for trial in range(3)]


@pytest.mark.slow
def test_following_a_batch_from_question_to_question_changes_nothing_in_it() -> None:
    plain = train_agents(ISLAND, CONSERVATIVE, keys(3, 4), OPTIMAL, max_ticks=60).counts
    trainer = QuestionTrainer(ISLAND, CONSERVATIVE, keys(3, 4), OPTIMAL, answers=20)
    followed = trainer.run(60).counts
    for name, tensor in plain.tensors().items():
        assert torch.equal(tensor, followed.tensors()[name]), name
    curves = trainer.curves()
    assert bool((curves.deaths.diff(dim=1) >= 0).all())
    assert bool((curves.deaths[:, -1] <= followed.deaths).all())
    done = followed.finished & (followed.queries.sum(1) < 20)
    assert bool(done.any())
    assert curves.regret[done, -1].abs().max() < 1e-12
    assert bool((curves.regret >= -1e-12).all())
    assert bool((curves.regret[:, 0] > 0).any())


def test_each_trial_stays_on_its_own_random_island() -> None:
    islands = island_levels(*ISLANDS[RANDOM])[:3]
    config = CONSERVATIVE.model_copy(update={"max_episode_steps": 4})
    trainer = QuestionTrainer(
        world_of(WORLD, islands, config), config, keys(0, 4), StopRule("ticks", 99), first=2
    )
    home = torch.tensor([2, 0, 1, 2])
    for _ in range(30):
        trainer.tick()
        assert torch.equal(trainer.state.world.level, home)


@pytest.mark.slow
def test_an_agent_that_asks_by_a_coin_asks_in_its_share_of_steps() -> None:
    changes = {"p_rec": 0.0, "p_pref": 0.0, "p_train": 0.0}
    life = (WORLD, "island", "conservative", changes)
    for share, most in ((0.0, 0), (0.5, 26), (1.0, 41)):
        rows = [
            row for row in question_trials("x", life, share, 40, (0, 8), 5) if not row.get("finished", True)
        ]
        asked = fmean(row["guidance"] for row in rows)
        assert asked <= most
        assert asked >= most / 3


def row(of: str, trial: int, **columns: object) -> Row:
    said = {"guidance": 8, "preference": 0, "deaths": 0, "finished": True, "area_deaths": 0, "area_regret": 1}
    return {"of": of, "trial": trial, **said, **columns}


def verdicts(rows: list[Row]) -> dict[str, bool | None]:
    return {one.what: one.agrees for one in findings(rows) if one.reference == "check"}


@pytest.mark.parametrize(
    ("values", "agrees"), [([8, 8.2] * 9, True), ([9, 9.2] * 9, False), ([1, 16] * 9, None)]
)
def test_a_goal_is_reached_or_missed_by_the_whole_interval(values: list[float], agrees: bool | None) -> None:
    assert at_most("x", values, 8.5).agrees is agrees


@pytest.mark.parametrize(("deaths", "trials", "agrees"), [(0, 300, True), (0, 20, None), (1, 300, False)])
def test_deaths_of_none_are_no_higher_only_if_enough_trials_say_so(
    deaths: int, trials: int, agrees: bool | None
) -> None:
    frugal = [row("frugal, island", trial, deaths=deaths * (trial % 2)) for trial in range(trials)]
    rows = frugal + [row("conservative, island", trial) for trial in range(trials)]
    found = verdicts(rows)
    assert found["island: deaths, frugal minus conservative"] is agrees
    assert found["frugal, island: deaths"] is agrees


def test_a_setting_is_chosen_by_pairs_of_the_same_agent() -> None:
    """Islands differ by far more than settings do, and an unfinished trial has no answers to compare."""
    chosen = [row(CHOSEN, trial, guidance=5 + 5 * (trial % 20)) for trial in range(40)]
    worse = [
        row(f"frugal, drawn pairs, {CHOICE}", one["trial"], guidance=one["guidance"] + 1 + one["trial"] % 3)
        for one in chosen
    ]
    worse[3] |= {"finished": False, "guidance": 0}
    better = [
        row(f"frugal, late steps, {CHOICE}", one["trial"], guidance=one["guidance"] - 1 - one["trial"] % 3)
        for one in chosen
    ]
    rows = [*chosen, *worse, *better]
    found = {one.what: one for one in findings(rows) if one.reference == "check"}
    what = f"{CHOICE}: answers, frugal minus frugal with"
    assert found[f"{what} drawn pairs"].agrees is True
    assert found[f"{what} late steps"].agrees is False
    assert found[f"{CHOICE}: trials unfinished, frugal minus frugal with drawn pairs"].ours == "-0.03"
    assert not any("unfinished" in name and "late steps" in name for name in found)
    assert verdict(rows) == (
        "The preset needs fewer answers than it does with *drawn pairs*; "
        "it needs more than with *late steps*."
    )


@pytest.mark.slow
def test_the_garden_is_watched_for_its_ticks_and_deployed_at_its_marks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(garden, "EPISODES", 2)
    *trials, first, second = garden.garden_trials("x", "frugal", 6, (0, 2), (1, 3), 0)
    assert [one["trial"] for one in trials] == [1, 2]
    assert {one["ticks"] for one in trials} == {6}
    assert all(1 <= one["guidance"] <= 6 for one in trials)
    assert (first["answers"], second["answers"]) == (0, 2)
    assert first["trials"] == second["trials"] == 2
    area = fmean(one["area_regret"] for one in trials)
    assert area == pytest.approx(first["regret_then"] + second["regret_then"])
    assert trials[0]["parent_waterings"] > trials[0]["waterings"] >= 0


def long_life(rates: list[float], trials: int = 20) -> list[Row]:
    return [
        row("frugal, T = 1", trial, window=window, answered=rate * 1000 + trial % 3, ticks=1000)
        for window, rate in enumerate(rates, start=1)
        for trial in range(trials)
    ]


def test_rates_that_do_not_fall_are_told() -> None:
    falling, rising = verdicts(long_life([0.1, 0.01, 0.001])), verdicts(long_life([0.1, 0.01, 0.2]))
    assert falling["frugal, T = 1: answers, windows below the first"] is True
    assert falling["frugal, T = 1: answers, last window"] is True
    assert falling["frugal, T = 1: deaths, windows below the first"] is None  # nobody died to begin with
    assert falling["frugal, T = 1: deaths, last window"] is True
    few = verdicts(long_life([0.1, 0.0], trials=2))
    assert few["frugal, T = 1: deaths, last window"] is None  # 2000 ticks without one do not tell
    assert rising["frugal, T = 1: answers, windows below the first"] is False
    assert rising["frugal, T = 1: answers, last window"] is False


@pytest.mark.slow
@pytest.mark.torture
@pytest.mark.timeout(length(1800, 7200))
@pytest.mark.parametrize("last", length([1], [1, 3]))
def test_questions_and_deaths_fall_towards_zero(last: int) -> None:
    """In CI an agent lives 160 ticks a stage; at night a hundred live 10,000 in the last one."""
    ticks, agents = length(160, 10_000), length(1, 100)
    life = (WORLD, "island", "frugal", {"max_clip_length": last})
    half = ticks if ticks >= 2000 else ticks // 2
    rows = long_trials("x", life, ticks, length(10, 200), (0, agents), 1, window=min(1000, half))
    first, final = (
        [one for one in rows if one["window"] == window] for window in (1, max(one["window"] for one in rows))
    )
    asked = [sum(one["answered"] for one in window) for window in (first, final)]
    assert asked[1] < asked[0]
    assert asked[1] <= 0.01 * max(agents, 2) * final[0]["ticks"]
    assert sum(one["deaths"] for one in final) <= 0.001 * max(agents, 2) * final[0]["ticks"]
