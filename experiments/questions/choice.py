"""The choice of frugal's settings: each against other values of it, on random islands."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from statistics import fmean

from parenting.evaluation.statistics import mean_interval
from parenting.experiments.questions.measures import raised
from parenting.experiments.questions.settings import CHOICE, CHOSEN, ISLANDS, RANDOM, TRIED
from parenting.experiments.reporting.comparison import Comparison, format_interval
from parenting.experiments.runner.store import Row

MEASURES: Mapping[str, Callable[[Row], float | None]] = {
    "answers": lambda row: row["guidance"] + row["preference"] if row["finished"] else None,
    "trials unfinished": lambda row: float(not row["finished"]),
    "deaths": lambda row: row["deaths"],
}
"""Of a trial; None where it has none."""


def choices(rows: Sequence[Row]) -> Iterator[Comparison]:
    """Whether each setting does at least as well as its other values: the whole interval decides.

    Unfinished trials and deaths are compared where there are any.
    """
    chosen = raised(CHOSEN, rows)
    for name in TRIED:
        other = raised(f"frugal, {name}, {CHOICE}", rows)
        if not chosen or not other:
            continue
        yield _compared("answers", name, chosen, other)
        for what in ("trials unfinished", "deaths"):
            if any(MEASURES[what](row) for row in (*chosen, *other)):
                yield _compared(what, name, chosen, other)


def _compared(what: str, name: str, chosen: Sequence[Row], other: Sequence[Row]) -> Comparison:
    """In pairs: the same agent on the same island. Islands are independent, the agents of one are not."""
    found = _by_island(MEASURES[what], chosen, other)
    interval = mean_interval(found)
    above = interval.above(0) if interval else None
    return Comparison(
        f"{CHOICE}: {what}, frugal minus frugal with {name}",
        "at most 0",
        f"{fmean(found):.2f}" if found else "-",
        interval=format_interval(interval),
        agrees=None if above is None else not above,
        reference="check",
    )


def _by_island(
    measure: Callable[[Row], float | None], chosen: Sequence[Row], other: Sequence[Row]
) -> list[float]:
    """The mean difference of each island, over the pairs of which both have the measure."""
    number = ISLANDS[RANDOM].number
    islands: list[list[float]] = [[] for _ in range(number)]
    theirs = {row["trial"]: measure(row) for row in other}
    for row in chosen:
        mine, its = measure(row), theirs[row["trial"]]
        if mine is not None and its is not None:
            islands[row["trial"] % number].append(mine - its)
    return [fmean(island) for island in islands if island]
