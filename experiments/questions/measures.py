"""Measures of trials on the page on questions: answers, deaths, rates, and their intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from statistics import fmean

from parenting.evaluation.statistics import (
    Interval,
    count_interval,
    proportion_interval,
)
from parenting.experiments.questions.settings import SHARED
from parenting.experiments.reporting.comparison import format_interval
from parenting.experiments.runner.store import Row


def raised(name: str, rows: Sequence[Row]) -> list[Row]:
    """The trials of an arm."""
    return [row for row in rows if row["of"] == name and "trial" in row]


def answers(rows: Sequence[Row]) -> list[float]:
    """Answers to both kinds of questions of the finished trials."""
    return [row["guidance"] + row.get("preference", 0) for row in rows if row["finished"]]


def deaths(rows: Sequence[Row]) -> list[float]:
    """Deaths of all trials, unfinished ones included."""
    return [row["deaths"] for row in rows]


def interval(values: Sequence[float]) -> Interval | None:
    """The interval of a mean; where no trial has an event, that of the proportion of trials with one."""
    if values and not any(values):
        return proportion_interval(0, len(values))
    return count_interval(values)


def shown(found: Interval | None) -> str:
    """An interval as it is shown, with more digits where it is near 0."""
    if found is None or found.high >= 0.1:
        return format_interval(found)
    return f"{found.low:.3f} to {found.high:.3f}"


def independent(
    name: str, rows: Sequence[Row], measure: Callable[[Sequence[Row]], list[float]]
) -> list[float]:
    """The measure of an arm's trials, or its means over the trials that share a level or a policy."""
    number = SHARED.get(name)
    if number is None:
        return measure(rows)
    groups = [measure([row for row in rows if row["trial"] % number == place]) for place in range(number)]
    return [fmean(group) for group in groups if group]


def left_out(rows: Sequence[Row]) -> str:
    """A note on unfinished trials; empty if there are none."""
    left = sum(not row["finished"] for row in rows)
    return f"{left} of {len(rows)} trials unfinished, excluded from the mean" if left else ""


def rates(name: str, column: str, rows: Sequence[Row]) -> list[list[float]]:
    """Of every window, each trial's rate a tick."""
    mine = [row for row in raised(name, rows) if "window" in row]
    windows = sorted({row["window"] for row in mine})
    return [[row[column] / row["ticks"] for row in mine if row["window"] == window] for window in windows]


def rate_interval(values: Sequence[float], ticks: int) -> Interval | None:
    """The interval of a rate; where all trials have the same, or none, that of the proportion of ticks."""
    if len(values) > 1 and len(set(values)) == 1:
        return proportion_interval(round(sum(values) * ticks), len(values) * ticks)
    return count_interval(values)
