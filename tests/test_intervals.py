"""Every interval of docs/results, computed again from its CSV: with scipy alone.

Nothing of `experiments/reporting` is used here: a row's words say which trials of the CSV it is about.
"""

from __future__ import annotations

import csv
import json
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from math import hypot, inf
from statistics import fmean
from typing import Any

import numpy as np
import pytest

from tests.interval_formulas import Ends, Row, numbers, of_counts, stats, student, welch, widened, wilson
from tests.intervals_beyond import fallible, panel, questions
from tests.tree import ROOT

PUBLISHED = ROOT / "docs/results"
NAMES = sorted(path.parent.name for path in PUBLISHED.glob("*/results.json"))
ARMS = {"repeated queries": "comparing twice"}
FIGURE2 = {
    "p_guid=0.99": "more guidance",
    "p_guid=0.95": "conservative",
    "p_guid=0.99, exploring starts": "more guidance, starts spread",
    "p_guid=0.99, own stage only": "more guidance, own length",
    "p_guid=0.99, 4 gradient steps": "more guidance, 4 gradient steps",
    "p_guid=0.99, pre-trained": "more guidance, pre-trained",
    "10,000 queries a stage": "10,000 a stage",
}
ALGORITHMS = {
    "traditional rl": "traditional",
    "direct policy learning": "direct",
    "lax parenting": "lax",
    "conservative parenting": "conservative",
}
OUTCOMES = {
    "leave the box stuck": ("stuck",),
    "press the button": ("button",),
    "step on the shortcut": ("shortcut",),
    "reach the goal": ("optimal", "detour"),
    "run into a wall": ("wall",),
    "optimal": ("optimal",),
}


def trials(name: str) -> list[Row]:
    with (PUBLISHED / name / "trials.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def rows(name: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads((PUBLISHED / name / "results.json").read_text())["findings"]
    return found


# One function a page: the ends of a row's interval, from its words and the trials


def table1(what: str, every: Sequence[Row]) -> Ends:
    def done(name: str, column: str) -> list[float]:
        mine = [row for row in every if row["of"] == ALGORITHMS[name.lower()] and row["finished"] == "True"]
        return numbers(mine, column)

    if what.startswith("trials whose"):
        mine = [row for row in every if row["of"] in ALGORITHMS.values()]
        at_once = {row["trial"] for row in mine if row["finished"] == "True" and int(row["ticks"]) <= 1}
        return wilson(len(at_once), len({row["trial"] for row in mine}))
    if order := re.fullmatch(r"order: deaths, (.*) minus (.*)", what):
        return welch(done(order[1], "deaths"), done(order[2], "deaths"))
    name, column = what.split(": ")
    return student(done(name, column))


def claim(what: str, every: Sequence[Row]) -> Ends:
    arm, counted = what.rsplit(": ", 1)
    arm = arm.replace("repeated queries", "comparing twice")
    mine = [row for row in every if row["of"] == arm]
    if counted in ("ticks", "unsafe moves during parenting"):
        column = "ticks" if counted == "ticks" else "deaths"
        return of_counts(numbers([row for row in mine if row["finished"] == "True"], column))
    place = "outcome"
    if "deployed" in counted:
        place += "_unsupervised" if "without the supervisor" in counted else "_supervised"
    words = next(words for ending, words in OUTCOMES.items() if counted.endswith(ending))
    return wilson(sum(row[place] in words for row in mine), len(mine))


def reward_hacking(what: str, every: Sequence[Row]) -> Ends:
    arm, queries, counted = re.fullmatch(r"(.*), after (\d+) queries: (.*)", what).groups()  # type: ignore[union-attr]
    arm = arm.replace("repeated queries", "comparing twice")
    mine = [row for row in every if (row["of"], row["queries"], row["there"]) == (arm, queries, "True")]
    if counted.startswith("in the bucket"):
        return wilson(sum(int(row["caught_100"]) > 50 for row in mine), len(mine))
    if steps := re.fullmatch(r"enter the bucket in any of 100 episodes of (\d+) steps", counted):
        return wilson(sum(int(row[f"bucket_{steps[1]}"]) > 0 for row in mine), len(mine))
    if steps := re.fullmatch(r"waterings in (\d+) steps", counted):
        return student(numbers(mine, f"waterings_{steps[1]}"))
    return student(numbers(mine, "deaths"))


def figure2(what: str, every: Sequence[Row]) -> Ends:
    if what.endswith("policy gradients without a bucket"):
        last = gradients(what.split(":")[0], every)
        return widened(student(numbers(last, "waterings")), fmean(numbers(last, "error")))
    level, inside, told = re.fullmatch(r"(.*), parent (.*?): (.*)", what).groups()  # type: ignore[union-attr]
    here = [row for row in every if (row["level"], row["inside"]) == (level, inside)]
    if one := re.fullmatch(r"(exact look-ahead|full-coverage agent), T = (\d)", told):
        of = {"exact look-ahead": "look-ahead", "full-coverage agent": "coverage"}[one[1]]
        (row,) = [row for row in here if (row["of"], row["stage"]) == (of, one[2])]
        low, high = stats().norm.interval(0.95, float(row["waterings"]), float(row["error"]))
        return low, high
    if one := re.fullmatch(r"(.*), gain from T = (\d) to T = (\d)", told):
        ends = [last_of(here, FIGURE2[one[1]], stage) for stage in one.groups()[1:]]
        before, after = (numbers(some, "waterings") for some in ends)
        gains = np.subtract(after, before).tolist()
        pairs = zip(*(numbers(some, "error") for some in ends), strict=True)
        return widened(student(gains), fmean([hypot(*pair) for pair in pairs]))
    if one := re.fullmatch(r"(.*), T = 4, minus 95 % of policy gradients", told):
        ours, theirs = last_of(here, FIGURE2[one[1]], "4"), gradients(level, every)
        error = hypot(fmean(numbers(ours, "error")), 0.95 * fmean(numbers(theirs, "error")))
        line = [0.95 * value for value in numbers(theirs, "waterings")]
        return widened(welch(numbers(ours, "waterings"), line), error)
    arm, queries = re.fullmatch(r"(.*), T = \d, (\d+) queries in total", told).groups()  # type: ignore[union-attr]
    mine = [
        row for row in here if (row["of"], row["queries"], row["there"]) == (FIGURE2[arm], queries, "True")
    ]
    return widened(student(numbers(mine, "waterings")), fmean(numbers(mine, "error")))


def gradients(level: str, every: Sequence[Row]) -> list[Row]:
    mine = [row for row in every if (row["of"], row["level"]) == ("policy gradients", level)]
    last = max(mine, key=lambda row: int(row["steps"]))["steps"]
    return [row for row in mine if row["steps"] == last]


def last_of(here: Sequence[Row], of: str, stage: str) -> list[Row]:
    mine = [row for row in here if (row["of"], row["stage"]) == (of, stage)]
    last = max(int(row["queries"]) for row in mine)
    return sorted((row for row in mine if int(row["queries"]) == last), key=lambda row: int(row["trial"]))


def figure3(what: str, every: Sequence[Row]) -> Ends:
    repeated = "True" if ", repeated queries" in what else "False"
    what = what.replace(", repeated queries", "").replace("X kept", "X and all taken along")
    curves = {
        name: [
            row
            for row in every
            if (row["curve"], row["recompare"], row["of"]) == (name, repeated, "parented")
        ]
        for name in {row["curve"] for row in every}
    }
    if what.startswith("median queries, "):
        mine = curves[what.removeprefix("median queries, ")]
        return median(needed(mine), [row["agent"] for row in mine])
    later, earlier = (curves[name] for name in what.split(" needs fewer queries than "))
    return tuple(100 * end for end in delong(later, earlier))  # type: ignore[return-value]


def needed(some: Sequence[Row]) -> list[float]:
    return [float(row["queries"]) if row["finished"] == "True" else inf for row in some]


def median(values: Sequence[float], agents: Sequence[str]) -> Ends:
    """The order statistics of a binomial distribution; or agents drawn with replacement, 9999 times."""
    if not any(agents):
        order, n = sorted(values), len(values)
        rank = int(stats().binom.ppf(0.025, n, 0.5))
        return order[rank - 1], order[n - rank]
    groups = defaultdict(list)
    for value, agent in zip(values, agents, strict=True):
        groups[agent].append(value)
    pools = list(groups.values())
    drawn = np.random.default_rng(7).integers(len(pools), size=(9999, len(pools)))
    with np.errstate(invalid="ignore"):
        medians = sorted(float(np.median([x for agent in each for x in pools[agent]])) for each in drawn)
    return medians[249], medians[9749]


def delong(later: Sequence[Row], earlier: Sequence[Row]) -> Ends:
    """Every pair of trials counted one by one; the variance of the agents' means, by Welch."""
    wins = np.array([[(x < y) + (x == y) / 2 for y in needed(earlier)] for x in needed(later)])
    means = [by_agent(wins.mean(axis), some) for axis, some in ((1, later), (0, earlier))]
    half = np.ptp(welch(*means)) / 2
    return max(0.0, wins.mean() - half), min(1.0, wins.mean() + half)


def by_agent(values: Sequence[float], some: Sequence[Row]) -> list[float]:
    groups = defaultdict(list)
    for value, row in zip(values, some, strict=True):
        groups[row["agent"] or f"trial {row['trial']}"].append(value)
    return [fmean(group) for group in groups.values()]


def value_iteration(what: str, every: Sequence[Row]) -> Ends:
    world, stage = re.fullmatch(r"(.*): agents that stage (\d) makes greedy for .*", what).groups()  # type: ignore[union-attr]
    agents: dict[tuple[str, ...], dict[str, Row]] = defaultdict(dict)
    for row in every:
        if world in ("all worlds", row["of"]) and int(row["stage"]) <= int(stage):
            agents[row["of"], row["trial"], row["level"]][row["stage"]] = row
    converged = [one for one in agents.values() if all(row["converged"] == "True" for row in one.values())]
    done = [one[stage] for one in converged]
    trained = [row for row in done if row["greedy_before"] != row["states"]]
    return wilson(sum(row["greedy"] == row["states"] for row in trained), len(trained))


PAGES: dict[str, Callable[[str, Sequence[Row]], Ends]] = {
    "table1": table1,
    "calibrate": table1,
    "reward-hacking": reward_hacking,
    "side-effects": claim,
    "interruptibility": claim,
    "absent-supervisor": claim,
    "figure2": figure2,
    "figure3": figure3,
    "value-iteration": value_iteration,
    "fallible": fallible,
    "panel": panel,
    "questions": questions,
}


def published(interval: str) -> Ends:
    ends = interval.removesuffix(" %").split(" to ")
    low, high = (inf if end == "not reached" else float(end) for end in ends)
    return low, high


def with_interval() -> Iterator[str]:
    yield from (name for name in NAMES if any(one["interval"] for one in rows(name)))


def test_all_pages_with_intervals_are_computed_again() -> None:
    assert set(with_interval()) == set(PAGES)


@pytest.mark.slow_after(7)
@pytest.mark.parametrize("name", PAGES)
def test_every_published_interval_follows_from_its_trials(name: str) -> None:
    every = trials(name)
    for one in rows(name):
        if one["interval"]:
            digits = re.findall(r"\d+(?:\.(\d+))?", one["interval"])
            rounding = 0.5 * 10 ** -min((len(digit) for digit in digits), default=0) + 1e-6
            if name == "figure3" and one["what"].startswith("median") and ", N = " in one["what"]:
                rounding = max(rounding, 8)  # another sequence of random numbers
            found = PAGES[name](one["what"], every)
            assert found == pytest.approx(published(one["interval"]), abs=rounding), one["what"]


@pytest.mark.parametrize("name", PAGES)
def test_only_trials_that_determine_none_are_without_an_interval(name: str) -> None:
    """A mean of several trials, or a count, has an interval unless its standard deviation is 0."""
    for one in rows(name):
        if " +- " in one["ours"] and "," not in one["ours"] and not one["interval"]:
            assert one["ours"].endswith("+- 0.00") or one["what"].startswith("queries of pre-parenting")
