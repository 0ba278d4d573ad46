"""The rows of Table 1: four algorithms, the paper's cells beside ours, and their order (Sec. 3.2.1)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from statistics import fmean
from typing import NamedTuple

from parenting.experiments.reporting.comparison import (
    LOST,
    SILENT,
    Comparison,
    ci_text,
    compare_count,
    difference_interval,
    format_interval,
    mean_interval,
    mean_sd,
)
from parenting.experiments.runner.store import Row

SELDOM = "0 or 1"
"""What the paper says of deaths by conservative parenting."""


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


def done(one: Algorithm, rows: Sequence[Row], column: str) -> list[float]:
    """What an algorithm's finished trials have in a column."""
    return [row[column] for row in rows if row["of"] == one.name and row["finished"]]


def cells(one: Algorithm, rows: Sequence[Row]) -> list[Comparison]:
    """A row of the table: the cells that the paper has, and ours of the rows of that algorithm."""
    mine = [row for row in rows if row["of"] == one.name]
    left = sum(not row["finished"] for row in mine)
    note = f"{left} of {len(mine)} trials unfinished, not in the mean" if left else ""
    columns = (("deaths", one.deaths), ("guidance", one.guidance), ("preference", one.preference))
    return [_cell(one, name, paper, done(one, rows, name), note) for name, paper in columns if paper != "-"]


def _cell(one: Algorithm, name: str, paper: str, values: Sequence[float], note: str) -> Comparison:
    legible = _legible(paper)
    once = f"{sum(value <= 1 for value in values)} of {len(values)} trials died at most once"
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
    """The mean of a cell of the paper, and its deviation, where they are legible."""
    mean, _, deviation = paper.partition(" +- ")
    return (float(mean), float(deviation) if deviation.isdigit() else None) if deviation else None


def reach(paper: str) -> tuple[float, float] | None:
    """From where to where a cell of the paper goes, where that is legible."""
    if paper == SELDOM:
        return 0, 1
    mean, deviation = _legible(paper) or (0, None)
    return None if deviation is None else (mean - deviation, mean + deviation)


def _agrees(paper: str, values: Sequence[float]) -> bool | None:
    """As AGREEMENT has it."""
    span, interval = reach(paper), mean_interval(values)
    if paper != SELDOM:
        return span[0] <= fmean(values) <= span[1] if span and values else None
    if interval is None or interval[0] <= 1 < interval[1]:
        return None
    return interval[1] <= 1


def order(rows: Sequence[Row]) -> list[Comparison]:
    """Whether each algorithm dies more often than the next one, by the difference of their means."""
    return [_more(more, less, rows) for more, less in pairwise(ALGORITHMS)]


def _more(more: Algorithm, less: Algorithm, rows: Sequence[Row]) -> Comparison:
    one, other = (done(each, rows, "deaths") for each in (more, less))
    interval = difference_interval(one, other)
    lost = LOST in (more.deaths, less.deaths)
    return Comparison(
        what=f"order: deaths by {more.title} less those by {less.title.lower()}",
        paper="above 0",
        ours=f"{fmean(one) - fmean(other):.2f}" if one and other else "-",
        interval=format_interval(interval),
        agrees=None if interval is None or interval[0] <= 0 <= interval[1] else interval[0] > 0,
        note="the paper's number of lax parenting is lost; its place is our reading" if lost else "",
    )


def born(rows: Sequence[Row]) -> Comparison:
    """How many trials begin with an optimal policy: all algorithms begin with the same ones.

    A parented agent is judged after its first tick, which teaches nothing, and a policy that learns from
    reward before its first step.
    """
    mine = [row for row in rows if row["of"] in {one.name for one in ALGORITHMS}]
    optimal = {row["trial"] for row in mine if row["finished"] and row["ticks"] <= 1}
    trials = {row["trial"] for row in mine}
    note = "in the means of all four with no deaths and no queries"
    return compare_count("trials that begin with an optimal policy", SILENT, len(optimal), len(trials), note)


AGREEMENT = (
    "A mean agrees if it lies within the paper's own deviation over trials; its interval may leave out the "
    "paper's mean all the same. Where the deviation is lost, nothing is said. "
    f'"{SELDOM}" is what the text of the paper says of deaths; the mean is lost. Ours agrees with it if its '
    "whole interval is at most 1, and does not if all of it is above; where the interval holds 1, nothing is "
    "said. How many trials died at most once stands beside it.",
    "The order of two algorithms agrees if the interval of the difference of their mean deaths lies above 0, "
    "and does not if it lies below. The paper's number of lax parenting is lost, and its place is our "
    "reading: it asks more than direct policy learning and less than conservative parenting.",
)
"""When a row agrees, for every page that has it."""
