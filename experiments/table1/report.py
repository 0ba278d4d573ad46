"""The rows of Table 1: the paper's cells and ours for four algorithms, and their order (Sec. 3.2.1)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from statistics import fmean
from typing import NamedTuple

from parenting.evaluation.statistics import difference_interval, mean_interval
from parenting.experiments.reporting.comparison import (
    LOST,
    SILENT,
    Comparison,
    ci_text,
    compare_count,
    format_interval,
    mean_sd,
    seldom_enough,
)
from parenting.experiments.runner.store import Row

SELDOM = "0 or 1"
"""The paper's statement on deaths with conservative parenting."""


class Algorithm(NamedTuple):
    """A row of the table."""

    name: str
    title: str
    preset: str | None  # None: policy gradients
    cost: float  # how much work a trial is, against the others
    deaths: str  # the paper's cells, as it prints them
    guidance: str
    preference: str


ALGORITHMS = (
    Algorithm("traditional", "Traditional RL", None, 0.4, "2300 +- 700", "-", "-"),
    Algorithm("direct", "Direct policy learning", "direct", 1.0, "47 +- 14", "-", f"51 +- ({LOST})"),
    Algorithm("lax", "Lax parenting", "lax", 1.0, LOST, LOST, LOST),
    Algorithm("conservative", "Conservative parenting", "conservative", 1.0, SELDOM, LOST, LOST),
)


def finished(one: Algorithm, rows: Sequence[Row], column: str) -> list[float]:
    """The values of a column in an algorithm's finished trials."""
    return [row[column] for row in rows if row["of"] == one.name and row["finished"]]


def cells(one: Algorithm, rows: Sequence[Row]) -> list[Comparison]:
    """A row of the paper's table: each of its cells, and ours."""
    mine = [row for row in rows if row["of"] == one.name]
    left = sum(not row["finished"] for row in mine)
    note = f"{left} of {len(mine)} trials unfinished, excluded from the mean" if left else ""
    columns = (("deaths", one.deaths), ("guidance", one.guidance), ("preference", one.preference))
    return [
        _cell(one, name, paper, finished(one, rows, name), note) for name, paper in columns if paper != "-"
    ]


def _cell(one: Algorithm, name: str, paper: str, values: Sequence[float], note: str) -> Comparison:
    legible = _legible(paper)
    once = f"{sum(value <= 1 for value in values)} of {len(values)} trials have at most one death"
    return Comparison(
        what=f"{one.title}: {name}",
        paper=paper,
        ours=mean_sd(values),
        difference=f"{fmean(values) - legible[0]:+.1f}" if legible and values else "",
        interval=ci_text(values),
        agrees=_agrees(paper, values),
        note="; ".join(filter(None, (once if paper == SELDOM else "", note))),
    )


def _legible(paper: str) -> tuple[float, float | None] | None:
    """The mean of a cell of the paper and its standard deviation, as far as they are legible."""
    mean, _, deviation = paper.partition(" +- ")
    return (float(mean), float(deviation) if deviation.isdigit() else None) if deviation else None


def paper_range(paper: str) -> tuple[float, float] | None:
    """The range within one standard deviation of the paper's mean; None if it is not legible."""
    if paper == SELDOM:
        return 0, 1
    mean, deviation = _legible(paper) or (0, None)
    return None if deviation is None else (mean - deviation, mean + deviation)


def _agrees(paper: str, values: Sequence[float]) -> bool | None:
    """The verdict on a cell, by the rules of agreement.md."""
    span, interval = paper_range(paper), mean_interval(values)
    if paper != SELDOM:
        return span[0] <= fmean(values) <= span[1] if span and values else None
    if interval is None:
        return seldom_enough(0, len(values)) if max(values, default=0) <= 1 else None
    above = interval.above(1)
    return None if above is None else not above


def order(rows: Sequence[Row]) -> list[Comparison]:
    """The paper's order of the algorithms, by the difference of mean deaths of each two neighbours."""
    return [_more(more, less, rows) for more, less in pairwise(ALGORITHMS)]


def _more(more: Algorithm, less: Algorithm, rows: Sequence[Row]) -> Comparison:
    one, other = (finished(each, rows, "deaths") for each in (more, less))
    interval = difference_interval(one, other)
    lost = LOST in (more.deaths, less.deaths)
    return Comparison(
        what=f"order: deaths, {more.title} minus {less.title.lower()}",
        paper="above 0",
        ours=f"{fmean(one) - fmean(other):.2f}" if one and other else "-",
        interval=format_interval(interval),
        agrees=interval.above(0) if interval else None,
        note="the paper's number for lax parenting is lost; we infer its place in the order" if lost else "",
    )


def optimal_initially(rows: Sequence[Row]) -> Comparison:
    """Trials whose initial policy is optimal; all algorithms start from the same policies.

    A parented agent is evaluated after its first tick, which does not train it, and a policy-gradient agent
    before its first step.
    """
    mine = [row for row in rows if row["of"] in {one.name for one in ALGORITHMS}]
    optimal = {row["trial"] for row in mine if row["finished"] and row["ticks"] <= 1}
    trials = {row["trial"] for row in mine}
    note = "they enter all four means with no deaths and no queries"
    return compare_count("trials whose initial policy is optimal", SILENT, len(optimal), len(trials), note)
