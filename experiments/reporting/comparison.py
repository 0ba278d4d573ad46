"""What an experiment found, beside what the paper says: numbers, intervals, and whether they agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import sqrt
from statistics import fmean, stdev, variance
from typing import Any

Z = 1.959964
"""Two-sided 95 % of a normal distribution."""
SILENT = "-"
"""What stands where the paper has no number."""
LOST = "lost"
"""What stands in place of a number that is not legible in our copy of the paper."""
NEVER = "never"
"""What stands where the paper claims in words that no trial does it."""


@dataclass(frozen=True)
class Comparison:
    """One number or claim of the paper, and ours."""

    what: str
    paper: str  # as the paper has it, or LOST
    ours: str
    difference: str = ""
    interval: str = ""  # 95 %, of ours
    agrees: bool | None = None  # None: there is nothing legible to compare with
    note: str = ""

    def plain(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


def mean_sd(values: Sequence[float]) -> str:
    """Mean +- standard deviation, over n - 1."""
    if not values:
        return "-"
    return f"{fmean(values):.2f}" + (f" +- {stdev(values):.2f}" if len(values) > 1 else "")


def mean_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """The 95 % confidence interval of a mean; None for fewer than two values."""
    if len(values) < 2:
        return None
    half = Z * stdev(values) / sqrt(len(values))
    return fmean(values) - half, fmean(values) + half


def difference_interval(more: Sequence[float], less: Sequence[float]) -> tuple[float, float] | None:
    """The 95 % interval of the difference of two means; None where either is of fewer than two values.

    The values count as drawn apart from each other.
    """
    if min(len(more), len(less)) < 2:
        return None
    half = Z * sqrt(variance(more) / len(more) + variance(less) / len(less))
    difference = fmean(more) - fmean(less)
    return difference - half, difference + half


def ci_text(values: Sequence[float]) -> str:
    """The interval of a mean as it is shown; empty where there is none."""
    return format_interval(mean_interval(values))


def format_interval(interval: tuple[float, float] | None) -> str:
    """An interval in words; none is an empty one."""
    return "" if interval is None else f"{interval[0]:.2f} to {interval[1]:.2f}"


def compare_mean(what: str, values: Sequence[float], note: str = "") -> Comparison:
    """A mean with its deviation and interval, of which the paper says nothing."""
    return Comparison(what=what, paper=SILENT, ours=mean_sd(values), interval=ci_text(values), note=note)


def proportion_interval(hits: int, trials: int) -> tuple[float, float]:
    """The 95 % confidence interval of a share, by Wilson's score: it holds for 0 of n, too.

    Raises:
        ValueError: there was no trial.
    """
    if trials < 1:
        raise ValueError("A share of no trials is no number.")
    share, z2 = hits / trials, Z * Z
    middle = (share + z2 / (2 * trials)) / (1 + z2 / trials)
    half = Z * sqrt(share * (1 - share) / trials + z2 / (4 * trials * trials)) / (1 + z2 / trials)
    return max(0.0, middle - half), min(1.0, middle + half)


def compare_count(what: str, paper: int | str, hits: int, trials: int, note: str = "") -> Comparison:
    """A count of trials beside the paper's, which is of 100, or NEVER, LOST or SILENT; it agrees where both
    are the same share.

    The difference is in points: what share of 100 trials ours is, less the paper's.
    """
    low, high = proportion_interval(hits, trials)
    number = 0 if paper == NEVER else paper
    return Comparison(
        what=what,
        paper=paper if isinstance(paper, str) else f"{paper} of 100",
        ours=f"{hits} of {trials}",
        difference="" if isinstance(number, str) else f"{100 * hits / trials - number:+.1f} points",
        interval=f"{100 * low:.1f} to {100 * high:.1f} %",
        agrees=None if isinstance(number, str) else hits / trials == number / 100,
        note=note,
    )
