"""`parenting run` in every world: what the argmax policies do, counted, and how it reads."""

from __future__ import annotations

from collections import Counter
from statistics import mean, stdev
from typing import Any

import pytest

from parenting.envs import registry
from tests.commands.test_run import results_of, run

PLAIN = ("--set", "pretrain=false", "--set", "max_episode_steps=8")
WALKED = ("unsafe-exploration", "interruptibility", "side-effects")
OUTCOMES = ("optimal", "detour", "time", "circle", "wall")


def tallied(rows: list[str], harm: str) -> dict[str, int]:
    """The counts as anyone makes them of the rows."""
    found = Counter(rows)
    assert set(found) <= {*OUTCOMES, harm}
    goal = found["optimal"] + found["detour"]
    return {"trials": len(rows), "goal": goal, **{name: found[name] for name in (*OUTCOMES, harm)}}


@pytest.mark.parametrize("world", WALKED)
def test_outcomes_are_counted(world: str) -> None:
    found = results_of(world, *PLAIN, "--trials", "6", "--until", "ticks:25", "--preset", "direct")
    harm = registry.spec(world).harm
    assert found["evaluation"] == tallied([row["outcome"] for row in found["trials"]], harm)
    assert [row["optimal"] for row in found["trials"]] == [
        row["outcome"] == "optimal" for row in found["trials"]
    ]
    assert "stages" not in found


@pytest.mark.slow
def test_both_deployments_of_the_supervisor() -> None:
    found = results_of("absent-supervisor", *PLAIN, "--trials", "6", "--until", "ticks:25")
    assert set(found["evaluation"]) == {"supervised", "unsupervised"}
    for where, counted in found["evaluation"].items():
        assert counted == tallied([row["outcome"][where] for row in found["trials"]], "shortcut")


def test_stages_of_a_world_with_a_goal() -> None:
    budget = ("--set", "max_clip_length=3", "--set", "queries_per_stage=4", "--until", "queries:8")
    found = results_of("side-effects", *PLAIN, *budget, "--trials", "4")
    one, two, three = found["stages"]
    assert [row["stage"] for row in found["stages"]] == [1, 2, 3]
    assert one["trials"] == two["trials"] == 4
    assert sum(two[name] for name in (*OUTCOMES, "stuck")) == 4
    assert 4 <= one["queries"] <= 5  # a question that was out when the stage ended belongs to it
    every = [row["guidance"] + row["preference"] for row in found["trials"]]
    assert every == [8] * 4
    assert sum(row["queries"] * row["trials"] for row in found["stages"] if row["trials"]) == 32
    if not three["trials"]:
        assert three["queries"] is None


def garden(*arguments: str) -> dict[str, Any]:
    return results_of("reward-hacking", "--level", "garden-mirrored", *PLAIN, "--set", "batch=8", *arguments)


@pytest.mark.slow
def test_stages_of_the_garden() -> None:
    budget = ("--set", "max_clip_length=2", "--set", "queries_per_stage=5", "--until", "queries:10")
    found = garden(*budget, "--trials", "3")
    first, last = found["stages"]
    assert (first["stage"], last["stage"]) == (1, 2)
    for row in found["stages"]:
        assert (row["trials"], row["episodes"], row["steps"]) == (3, 1000, 8)
        assert row["se"] == pytest.approx(row["sd"] / 3**0.5)
        assert row["parent"] == found["evaluation"]["parent"] > 0
    means = [row["outcome"]["waterings"] for row in found["trials"]]
    assert last["waterings"] == found["evaluation"]["waterings"] == pytest.approx(mean(means))
    assert last["sd"] == pytest.approx(stdev(means))
    assert last["bucket"] == sum(row["outcome"]["bucket"] for row in found["trials"])


def test_the_garden_stops_after_queries_unless_told_otherwise() -> None:
    found = garden("--max-ticks", "2")
    assert found["until"] == "queries:1000"
    assert (found["unfinished"], found["stuck"]) == (1, 0)
    (row,) = found["stages"]  # one stage, and one trial: nothing to take a deviation of
    assert (row["trials"], row["sd"], row["se"]) == (1, None, None)


def test_two_budgets_say_how_many_stages_there_are() -> None:
    """Nine queries, four a stage: two whole stages, and one that is cut off. Whoever says stages is heard."""
    budget = (*PLAIN, "--set", "queries_per_stage=4", "--until", "queries:9", "--max-ticks", "1")
    assert results_of("side-effects", *budget)["config"]["stages"] == 3
    assert results_of("side-effects", *budget, "--set", "max_clip_length=1")["config"]["stages"] == 1
    many = run("side-effects", *PLAIN, "--set", "queries_per_stage=1", "--until", "queries:17")
    assert many.exit_code == 2
    assert "are 17 stages" in many.stderr
    refused = run("side-effects", *PLAIN, "--set", "queries_per_stage=4", "--until", "ticks:1")
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert "max_clip_length=2" in refused.stderr


def lines(*arguments: str) -> dict[str, str]:
    """The page, by the words at the beginning of its lines."""
    result = run(*arguments, *PLAIN, "--workers", "1")
    assert result.exit_code == 0, result.output
    return {line[2:14].strip(): line[14:] for line in result.stdout.splitlines()[1:]}


def test_page_in_plain_words() -> None:
    page = lines("interruptibility", "--until", "ticks:3", "--trials", "2")
    assert "0 button" in page["at the end"]
    assert page["ticks"] == "3.00 +- 0.00"
    page = lines("absent-supervisor", "--until", "ticks:3")
    assert page["at the end"].startswith("unsupervised: ")  # the line below that of the supervised
    page = lines("side-effects", "--until", "queries:9", "--max-ticks", "2", "--set", "max_clip_length=2")
    assert page["unfinished"].startswith("1 after 2 ticks")
    assert page["stage 2"] == "no trial came to it"


def test_page_of_the_garden() -> None:
    page = lines("reward-hacking", "--until", "ticks:3", "--trials", "2")
    assert "optimal" not in page
    for name in ("at the end", "stage 1"):
        assert "waterings in 8 steps (the parent: " in page[name]
        assert "steps end in the bucket" in page[name]
