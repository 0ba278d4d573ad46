"""The rows of Fig. 2: which are of what, and how surely their means are known."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt
from statistics import fmean, stdev
from typing import NamedTuple

from parenting.experiments.reporting.comparison import Z
from parenting.experiments.runner.store import Row

LIVED = "more guidance"
"""The life that is lived in all gardens, by both parents."""
MANY = "10,000 a stage"
"""The life whose sample grows within a stage."""
STUDENT = {2: 12.706, 3: 4.303, 4: 3.182, 5: 2.776, 6: 2.571, 7: 2.447, 8: 2.365, 9: 2.306, 10: 2.262}
"""Two-sided 95 % of Student's t by the number of trials: three of them say much less than Z would have it."""


class Range(NamedTuple):
    """A 95 % confidence interval."""

    low: float
    high: float

    def __str__(self) -> str:
        """As the tables show it."""
        return f"{self.low:.2f} to {self.high:.2f}"

    def above(self, line: float) -> bool | None:
        """Whether all of it lies above a line, or all of it does not; None where it holds the line."""
        return None if self.low <= line <= self.high else self.low > line


def around(mean: float, error: float) -> Range:
    """Of a mean over episodes with its standard error: what one policy waters."""
    return Range(mean - Z * error, mean + Z * error)


def among(values: Sequence[float], error: float) -> Range | None:
    """Of a mean over trials; None for fewer than two, which say nothing of others.

    `error` is the standard error that the shared weather gives every trial alike, and so their mean, too.
    """
    if len(values) < 2:
        return None
    trials = STUDENT.get(len(values), Z) * stdev(values) / sqrt(len(values))
    half = hypot(trials, Z * error)
    return Range(fmean(values) - half, fmean(values) + half)


def watered(rows: Sequence[Row]) -> Range | None:
    """The interval of what trials water on their mean, in one weather."""
    if not rows:
        return None
    return among([row["waterings"] for row in rows], fmean(row["error"] for row in rows))


def kinds(rows: Sequence[Row]) -> list[tuple[str, str, str]]:
    """Life, garden and parent, of all lives."""
    return list(dict.fromkeys((row["of"], row["level"], row["inside"]) for row in rows if "queries" in row))


def of(rows: Sequence[Row], name: str) -> list[Row]:
    """The rows of a life or a line."""
    return [row for row in rows if row["of"] == name]


def line(rows: Sequence[Row], name: str, like: Row) -> float | None:
    """What a line says where a row is: same garden, same parent, and for the look-ahead same T."""
    for row in of(rows, name):
        alike = (row["level"], row["inside"]) == (like["level"], like["inside"])
        if alike and (name == "parent" or row["stage"] == like["stage"]):
            found: float = row["waterings"]
            return found
    return None


def where(row: Row) -> str:
    """Its garden and its parent."""
    return f"{row['level']}, {row['inside']}"
