"""A row of a results page: a number of ours, what it is compared with, and whether they agree."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean, stdev
from typing import Any, Literal

from parenting.evaluation.statistics import Interval, count_interval, proportion_interval

Reference = Literal["paper", "fit", "check"]
REFERENCES: tuple[Reference, ...] = ("paper", "fit", "check")
"""Counterparts of a row: the paper; the paper, after tuning to it; our own number, an exact
solution or another arm."""
YES, NO, OPEN, NOTHING = "yes", "no", "open", "nothing"
"""The verdicts on a row."""
SILENT = "-"
"""Stands where the paper has no number."""
LOST = "lost"
"""Stands in place of a number that is not legible in our copy of the paper."""
NEVER = "never"
"""Stands where the paper claims in words that no trial does it."""
NONE_OF_100 = "0 of 100"
"""Stands where the paper counted 100 trials, none of which does it."""
RARE = 0.05
"""A count of 0 agrees with *never* once its interval ends at this proportion or below."""


@dataclass(frozen=True)
class Comparison:
    """One number or claim, and ours. Its fields are the keys of a row in results.json."""

    what: str
    paper: str  # what ours is compared with: as the paper has it, LOST, SILENT, or what a check expects
    ours: str
    difference: str = ""
    interval: str = ""  # 95 %, of ours
    agrees: bool | None = None  # None: no verdict
    note: str = ""
    reference: Reference | None = "paper"  # None: ours is compared with nothing

    def plain(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


def mean_sd(values: Sequence[float]) -> str:
    """Mean +- standard deviation, over n - 1."""
    if not values:
        return "-"
    return f"{fmean(values):.2f}" + (f" +- {stdev(values):.2f}" if len(values) > 1 else "")


def ci_text(values: Sequence[float]) -> str:
    """The interval of a mean of numbers that are never negative as it is shown; empty if there is none."""
    return format_interval(count_interval(values))


def format_interval(interval: Interval | None) -> str:
    """An interval as it is shown; empty if there is none."""
    return "" if interval is None else f"{interval.low:.2f} to {interval.high:.2f}"


def format_percent(interval: Interval) -> str:
    """An interval of a proportion as it is shown."""
    return f"{100 * interval.low:.1f} to {100 * interval.high:.1f} %"


def compare_mean(what: str, values: Sequence[float], note: str = "") -> Comparison:
    """A mean of numbers that are never negative, of which the paper says nothing."""
    return Comparison(what, SILENT, mean_sd(values), interval=ci_text(values), note=note, reference=None)


def compare_count(what: str, paper: str, hits: int, trials: int, note: str = "") -> Comparison:
    """A count of trials.

    The paper's may be NEVER or NONE_OF_100; then the verdict is `seldom_enough`, and the difference is in
    percentage points. With LOST or SILENT there is neither.
    """
    interval = proportion_interval(hits, trials)
    claimed = paper in (NEVER, NONE_OF_100)
    return Comparison(
        what=what,
        paper=paper,
        ours=f"{hits} of {trials}",
        difference=f"{100 * hits / trials:+.1f} points" if claimed else "",
        interval=format_percent(interval),
        agrees=seldom_enough(hits, trials) if claimed else None,
        note=note,
        reference=None if paper == SILENT else "paper",
    )


def seldom_enough(hits: int, trials: int) -> bool | None:
    """Judge a count that should be 0.

    One counterexample refutes it. Without one, trials support it only if the interval of their proportion
    ends at RARE or below; 0 of 4 proves nothing, and neither does 0 of no trials.
    """
    if hits:
        return False
    return True if trials and proportion_interval(0, trials).high <= RARE else None


def verdict(row: Comparison) -> str:
    """YES, NO, OPEN (compared, without a verdict) or NOTHING (not compared, or with a lost number)."""
    if row.agrees is not None:
        return YES if row.agrees else NO
    return NOTHING if row.reference is None or row.paper in (SILENT, LOST) else OPEN


def count_verdicts(rows: Iterable[Comparison]) -> dict[str, dict[str, int]]:
    """The number of rows that agree, that do not, and that are open, by what they are compared with."""
    counts: dict[str, dict[str, int]] = {one: {YES: 0, NO: 0, OPEN: 0} for one in REFERENCES}
    for row in rows:
        if row.reference is not None and verdict(row) != NOTHING:
            counts[row.reference][verdict(row)] += 1
    return counts
