"""The rows of the panel experiment: how often each rule is right, and what its agents come to."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean
from typing import NamedTuple

from parenting.evaluation.statistics import mean_interval
from parenting.experiments.panel.settings import (
    ALONE,
    DAWID_SKENE,
    MAJORITY,
    OPINION,
    PANELS,
    RULES,
    TOGETHER,
    TRUST,
)
from parenting.experiments.reporting.comparison import (
    SILENT,
    Comparison,
    compare_count,
    compare_mean,
    format_interval,
)
from parenting.experiments.runner.store import Row


class Claim(NamedTuple):
    """One rule is said to be better than another."""

    better: str
    worse: str
    rows: str  # "right" or "deaths"


CLAIMS = (
    Claim(TRUST, MAJORITY, "right"),
    Claim(TRUST, DAWID_SKENE, "right"),
    Claim(OPINION, TRUST, "right"),
    Claim(OPINION, ALONE, "right"),
    Claim(OPINION, MAJORITY, "deaths"),
    Claim(OPINION, ALONE, "deaths"),
)


def of(rows: Sequence[Row], panel: str, rule: str) -> list[Row]:
    """The trials of an arm."""
    return [row for row in rows if row["panel"] == panel and row["of"] == rule]


def right(rows: Sequence[Row]) -> list[float]:
    """The percentage of right answers in each trial."""
    return [100 * row["right"] / row["asked"] for row in rows if row["asked"]]


def findings(rows: Sequence[Row]) -> list[Comparison]:
    """The claims for each panel, and what was measured in each arm."""
    claimed = [_claim(panel.name, claim, rows) for panel in PANELS for claim in CLAIMS]
    measured = [
        one
        for panel in PANELS
        for rule in RULES
        for one in _arm(panel.name, rule, of(rows, panel.name, rule))
    ]
    return [*claimed, *measured]


def _claim(panel: str, claim: Claim, rows: Sequence[Row]) -> Comparison:
    """The difference of two rules, so that above 0 is better, paired: trial i of both draws the same."""
    better, worse = of(rows, panel, claim.better), of(rows, panel, claim.worse)
    if claim.rows == "right":
        pairs = [pair for pair in zip(better, worse, strict=True) if pair[0]["asked"] and pair[1]["asked"]]
        what, unit = "right answers", " points"
        more, less = right([pair[0] for pair in pairs]), right([pair[1] for pair in pairs])
    else:
        what, unit = "deaths", ""
        more, less = [row["deaths"] for row in worse], [row["deaths"] for row in better]
    names = (claim.better, claim.worse) if claim.rows == "right" else (claim.worse, claim.better)
    interval = mean_interval([one - other for one, other in zip(more, less, strict=True)])
    return Comparison(
        what=f"{panel}: {what}, {names[0]} minus {names[1]}",
        paper="above 0",
        ours=f"{fmean(more) - fmean(less):.2f}{unit}",
        interval=format_interval(interval),
        agrees=interval.above(0) if interval else None,
        reference="check",
    )


def _arm(panel: str, rule: str, rows: Sequence[Row]) -> list[Comparison]:
    arm = f"{panel}, {rule}"
    questions = [row["guidance"] + row["preference"] for row in rows]
    return [
        compare_mean(f"{arm}: right answers in %", right(rows)),
        compare_mean(f"{arm}: deaths", [row["deaths"] for row in rows]),
        compare_mean(f"{arm}: questions", questions),
        compare_count(f"{arm}: optimal at the end", SILENT, sum(row["optimal"] for row in rows), len(rows)),
    ]


def best(rows: Sequence[Row], panel: str) -> str:
    """The rule with the most right answers among those that hear the whole panel."""
    return max(TOGETHER, key=lambda rule: fmean(right(of(rows, panel, rule))))
