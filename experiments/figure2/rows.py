"""Rows of Figure 2's trials: selection by arm, garden, parent and stage, and intervals of their means."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean

from parenting.evaluation.statistics import Interval, mean_interval
from parenting.experiments.runner.store import Row

MAIN = "more guidance"
"""The arm that is run in all gardens with both parents."""
MANY = "10,000 a stage"
"""The arm that is evaluated several times within a stage, as its queries accumulate."""
COVERAGE = "coverage"
NAMES = {
    MAIN: "p_guid=0.99",
    "conservative": "p_guid=0.95",
    "more guidance, starts spread": "p_guid=0.99, exploring starts",
    "more guidance, own length": "p_guid=0.99, own stage only",
    "more guidance, 4 gradient steps": "p_guid=0.99, 4 gradient steps",
    "more guidance, pre-trained": "p_guid=0.99, pre-trained",
    MANY: "10,000 queries a stage",
    COVERAGE: "full-coverage agent",
}
"""Names in trials.csv, and what they are called on the page: an arm by its setting."""


def shown(name: str) -> str:
    """The name of an arm on the page."""
    return NAMES.get(name, name)


def setting(row: Row) -> str:
    """Garden and parent of a row, as the page names them."""
    return f"{row['level']}, parent {row['inside']}"


def of(rows: Sequence[Row], name: str) -> list[Row]:
    """The rows of an arm or a baseline."""
    return [row for row in rows if row["of"] == name]


def arms(rows: Sequence[Row]) -> list[tuple[str, str, str]]:
    """Name, garden and parent of every arm that answers queries."""
    return list(dict.fromkeys((row["of"], row["level"], row["inside"]) for row in rows if "queries" in row))


def baseline(rows: Sequence[Row], name: str, like: Row) -> float | None:
    """Mean waterings of a baseline for the same garden and parent; of the look-ahead at the same T."""
    for row in of(rows, name):
        alike = (row["level"], row["inside"]) == (like["level"], like["inside"])
        if alike and (name == "parent" or row["stage"] == like["stage"]):
            found: float = row["waterings"]
            return found
    return None


def gradients(rows: Sequence[Row], level: str) -> list[Row]:
    """Policy gradients in a garden after the last of their gradient steps, a row for each trial."""
    mine = [row for row in of(rows, "policy gradients") if row["level"] == level]
    last = max((row["steps"] for row in mine), default=0)
    return [row for row in mine if row["steps"] == last]


def waterings(rows: Sequence[Row]) -> list[float]:
    """Mean waterings of each trial."""
    return [row["waterings"] for row in rows]


def error(rows: Sequence[Row]) -> float:
    """Standard error that all trials share, because they are evaluated on the same episodes."""
    return fmean(row["error"] for row in rows)


def interval(rows: Sequence[Row]) -> Interval | None:
    """Interval of the mean waterings over trials."""
    return mean_interval(waterings(rows), error(rows)) if rows else None
