"""The ends of the intervals on the pages beyond the paper, from a row's words and the trials."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Sequence
from statistics import fmean

from tests.interval_formulas import Ends, Row, numbers, of_counts, student, welch, wilson

IDEAL = "ideal tabular agent"


def fallible(what: str, every: Sequence[Row]) -> Ends:
    arms, measure = what.rsplit(": ", 1)

    def measured(arm: str) -> list[float]:
        mine = [row for row in every if row["of"] == arm]
        if measure == "questions":
            return [float(row["guidance"]) + float(row["preference"]) for row in mine]
        if not measure.endswith(" until optimal"):
            return numbers(mine, measure)
        column = "optimal_deaths" if measure.startswith("deaths") else "optimal_queries"
        return numbers([row for row in mine if row["optimal_at"] != "0"], column)

    if measure == "optimal at the end":
        mine = [row for row in every if row["of"] == arms]
        return wilson(sum(row["optimal"] == "True" for row in mine), len(mine))
    if measure == "optimal once, not at the end":
        once = [row for row in every if row["of"] == arms and row["optimal_at"] != "0"]
        return wilson(sum(row["optimal"] == "False" for row in once), len(once))
    one, _, other = arms.partition(" minus ")
    return welch(measured(one), measured(other)) if other else of_counts(measured(one))


def panel(what: str, every: Sequence[Row]) -> Ends:
    def measured(group: str, rule: str, measure: str) -> list[float]:
        mine = [row for row in every if (row["panel"], row["of"]) == (group, rule)]
        if measure == "deaths":
            return numbers(mine, "deaths")
        if measure == "questions":
            return [float(row["guidance"]) + float(row["preference"]) for row in mine]
        return [100 * float(row["right"]) / float(row["asked"]) for row in mine if row["asked"] != "0"]

    if claim := re.fullmatch(r"(.*): (right answers|deaths), (.*) minus (.*)", what):
        group, measure, one, other = claim.groups()
        more, less = measured(group, one, measure), measured(group, other, measure)
        return student([one - other for one, other in zip(more, less, strict=True)])  # the same draws
    arm, measure = what.split(": ")
    group, rule = arm.rsplit(", ", 1)
    if measure == "optimal at the end":
        mine = [row for row in every if (row["panel"], row["of"]) == (group, rule)]
        return wilson(sum(row["optimal"] == "True" for row in mine), len(mine))
    return student(measured(group, rule, measure))


def in_pairs(measure: str, chosen: Sequence[Row], other: Sequence[Row]) -> list[float]:
    """The mean difference of each of twenty islands, over the agents that have both values."""

    def value(row: Row) -> float | None:
        if measure == "trials unfinished":
            return float(row["finished"] == "False")
        answers = float(row["guidance"]) + float(row["preference"])
        return float(row["deaths"]) if measure == "deaths" else answers if row["finished"] == "True" else None

    islands = defaultdict[int, list[float]](list)
    for one, another in zip(chosen, other, strict=True):
        mine, theirs = value(one), value(another)
        if mine is not None and theirs is not None:
            islands[int(one["trial"]) % 20].append(mine - theirs)
    return [fmean(island) for island in islands.values()]


def gardens(arm: str, measure: str, every: Sequence[Row]) -> Ends:
    def measured(name: str, what: str) -> list[float]:
        mine = [row for row in every if row["of"] == name and row["trial"]]
        if what.startswith("answers"):
            return [float(row["guidance"]) + float(row["preference"]) for row in mine]
        column = "deaths" if "bucket" in what else "waterings" if "waterings" in what else "area_regret"
        return numbers(mine, column)

    if not measure.endswith(", frugal minus conservative"):
        values = measured(arm, measure)
        low, high = wilson(0, len(values))
        return of_counts(values) if any(values) else (low / 100, high / 100)
    ours, theirs = (measured(f"{name}, garden", measure) for name in ("frugal", "conservative"))
    if any((*ours, *theirs)):
        return welch(ours, theirs)
    return -wilson(0, len(theirs))[1] / 100, wilson(0, len(ours))[1] / 100


def questions(what: str, every: Sequence[Row]) -> Ends:
    def of(arm: str) -> list[Row]:
        return [row for row in every if row["of"] == arm and row["trial"]]

    def measured(arm: str, value: Callable[[Row], float]) -> list[float]:
        """The values of trials; where these share policies or islands in rotation, the means of those."""
        rows = [row for row in of(arm) if row["finished"] == "True" or value is died]
        shared = 5 if "pre-parented" in arm else 20 if "random islands" in arm else len(rows) + 1
        groups = defaultdict[int, list[float]](list)
        for place, row in enumerate(rows):
            groups[int(row["trial"]) % shared if shared < len(rows) else place].append(value(row))
        return [fmean(group) for group in groups.values()]

    def answers(arm: str) -> list[float]:
        return measured(arm, lambda row: float(row["guidance"]) + float(row["preference"] or 0))

    def died(row: Row) -> float:
        return float(row["deaths"])

    if level := re.fullmatch(f"(.*): answers of the {IDEAL}", what):
        return student(answers(f"{IDEAL}, {level[1]}"))
    if started := re.fullmatch("pre-parenting for (.*): answers of each agent", what):
        return student(
            numbers([row for row in every if row["of"] == f"pre-parented, {started[1]}"], "guidance")
        )
    arm, measure = what.rsplit(": ", 1)
    if both := re.fullmatch("(answers|deaths), frugal minus conservative", measure):
        named = [f"{name}, {arm}" for name in ("frugal", "conservative")]
        ours, theirs = (answers(one) if both[1] == "answers" else measured(one, died) for one in named)
        if "random islands" in arm:
            return student([own - other for own, other in zip(ours, theirs, strict=True)])
        if any((*ours, *theirs)):
            return welch(ours, theirs)
        return -wilson(0, len(theirs))[1] / 100, wilson(0, len(ours))[1] / 100
    if against := re.fullmatch("(answers|trials unfinished|deaths), frugal minus frugal with (.*)", measure):
        return student(in_pairs(against[1], of(f"frugal, {arm}"), of(f"frugal, {against[2]}, {arm}")))
    if "garden" in arm:
        return gardens(arm, measure, every)
    if measure.startswith("answers minus"):
        return welch(answers(arm), answers(f"{IDEAL}, {arm.rsplit(', ', 1)[1]}"))
    if measure == "optimal at the end":
        return wilson(sum(row["optimal"] == "1" or row["optimal"] == "True" for row in of(arm)), len(of(arm)))
    if area := re.match("area under (deaths|regret)", measure):
        return student(numbers(of(arm), f"area_{area[1]}"))
    values = measured(arm, died) if measure == "deaths" else answers(arm)
    if any(values):
        return of_counts(values)
    low, high = wilson(0, len(of(arm)))
    return low / 100, high / 100
