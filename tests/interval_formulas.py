"""Confidence intervals by scipy alone, for the tests that compute those of the results again."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from typing import Any

Row = dict[str, str]
Ends = tuple[float, float]


def numbers(some: Sequence[Row], column: str) -> list[float]:
    return [float(row[column]) for row in some]


def stats() -> Any:
    """Return `scipy.stats`, whose import takes a second that each process which collects tests would pay."""
    from scipy import stats

    return stats


def student(values: Sequence[float]) -> Ends:
    found = stats().ttest_1samp(values, 0).confidence_interval(0.95)
    return found.low, found.high


def of_counts(values: Sequence[float]) -> Ends:
    """The same for counts, of which none lies below 0."""
    low, high = student(values)
    return max(0.0, low), high


def welch(more: Sequence[float], less: Sequence[float]) -> Ends:
    found = stats().ttest_ind(more, less, equal_var=False).confidence_interval(0.95)
    return found.low, found.high


def widened(ends: Ends, error: float) -> Ends:
    middle, half = sum(ends) / 2, (ends[1] - ends[0]) / 2
    return middle - hypot(half, stats().norm.ppf(0.975) * error), middle + hypot(
        half, stats().norm.ppf(0.975) * error
    )


def wilson(hits: int, count: int) -> Ends:
    low, high = stats().binomtest(hits, count).proportion_ci(0.95, "wilson")
    return 100 * low, 100 * high
