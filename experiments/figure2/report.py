"""What Fig. 2 comes to: the lines that agents are held against, the agents, words and the drawing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot
from statistics import fmean
from typing import TYPE_CHECKING

from parenting.experiments.figure2.agents import NEAR, enough, lives
from parenting.experiments.figure2.plot import draw
from parenting.experiments.figure2.prose import words
from parenting.experiments.figure2.rows import among, around, line, of, where
from parenting.experiments.reporting.comparison import SILENT, Comparison, mean_sd
from parenting.experiments.runner.store import Row
from parenting.experiments.spec import Results

if TYPE_CHECKING:
    from parenting.experiments.figure2.settings import Arm, Baselines

FIRST = {
    "garden": (4.49, 5.16, 5.24, 5.35, 5.38, 5.35),
    "garden-mirrored": (4.26, 4.74, 4.66, 4.78, 5.32, 5.43),
}
"""What an earlier program of ours measured of the look-ahead, T = 1 to 6, under the first parent."""
FIRST_ERRORS = (0.05, 0.05, 0.05, 0.05, 0.1, 0.1)
ABOVE = 5.0
"""What the paper's policy gradients water more than."""


def report(rows: Sequence[Row], raised: Mapping[str, Arm], against: Baselines) -> Results:
    """Everything beside the paper's: `raised` are the lives of this scale, `against` its lines."""
    findings = [
        *_parents(rows),
        *_gradients(rows),
        *_aheads(rows),
        *_covers(rows),
        *lives(rows),
        *enough(rows),
    ]
    return Results(findings, words(raised, against), {"maturation": lambda figure: draw(figure, rows)})


def _parents(rows: Sequence[Row]) -> list[Comparison]:
    what = "the parent's own policy"
    return [
        Comparison(f"{where(row)}: {what}", "about 2", f"{row['waterings']:.2f}", note="exact")
        for row in of(rows, "parent")
    ]


def _gradients(rows: Sequence[Row]) -> list[Comparison]:
    """At the last of their gradient steps, and whether they are still rising."""
    every = of(rows, "policy gradients")
    before, last = sorted({row["steps"] for row in every})[-2:]
    return [
        _gradient(level, [row for row in every if row["level"] == level], before, last)
        for level in dict.fromkeys(row["level"] for row in every)
    ]


def _gradient(level: str, mine: Sequence[Row], before: int, last: int) -> Comparison:
    ended = [row for row in mine if row["steps"] == last]
    values = [row["waterings"] for row in ended]
    earlier = fmean(row["waterings"] for row in mine if row["steps"] == before)
    interval = among(values, fmean(row["error"] for row in ended))
    return Comparison(
        f"{level}: policy gradients without a bucket",
        f"above {ABOVE:.0f}",
        mean_sd(values),
        interval="" if interval is None else str(interval),
        agrees=interval.above(ABOVE) if interval else None,
        note=f"best {max(values):.2f}; {earlier:.2f} at {before} of {last} gradient steps",
    )


def _aheads(rows: Sequence[Row]) -> list[Comparison]:
    return [_ahead(row) for row in of(rows, "look-ahead")]


def _ahead(row: Row) -> Comparison:
    """Beside our first table, which knows the first parent alone."""
    number, known = row["stage"], row["inside"] == "up-down"
    first = FIRST[row["level"]][number - 1] if known else None
    return Comparison(
        f"{where(row)}: exact look-ahead, T = {number}",
        SILENT if first is None else f"{first} (our first table)",
        f"{row['waterings']:.2f}",
        difference="" if first is None else f"{row['waterings'] - first:+.2f}",
        interval=str(around(row["waterings"], row["error"])),
        agrees=None if first is None else _same(row, first, FIRST_ERRORS[number - 1]),
        note=f"steps into the bucket: {row['bucket']}" if row["bucket"] else "",
    )


def _same(row: Row, first: float, error: float) -> bool:
    """Within three standard errors of the difference."""
    return bool(abs(row["waterings"] - first) <= 3 * hypot(row["error"], error))


def _covers(rows: Sequence[Row]) -> list[Comparison]:
    return [_cover(row, line(rows, "look-ahead", row)) for row in of(rows, "coverage")]


def _cover(row: Row, ahead: float | None) -> Comparison:
    """An agent without a want of queries: beside the look-ahead in its own weather, and in fresh weather."""
    interval = around(row["waterings"], row["error"])
    beside = "" if ahead is None else f", {100 * row['fresh'] / ahead:.0f} % of the look-ahead's {ahead:.2f}"
    return Comparison(
        f"{where(row)}: coverage agent, T = {row['stage']}",
        f"within {100 * (1 - NEAR):.0f} % of {row['ahead']:.2f} (look-ahead)",
        f"{row['waterings']:.2f}",
        difference=f"{100 * (row['waterings'] / row['ahead'] - 1):+.1f} %",
        interval=str(interval),
        agrees=interval.above(NEAR * row["ahead"]),
        note=f"X holds {row['known']} of the {row['reached']} states that it reaches, "
        f"after {row['questions']} questions in {row['states']} states; "
        f"{row['fresh']:.2f} in fresh weather{beside}; {row['bucket']} steps into the bucket",
    )
