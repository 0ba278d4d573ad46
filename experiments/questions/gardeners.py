"""The rows of the garden on the page on questions: verdicts between both presets, then every number."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from statistics import fmean

from parenting.evaluation.statistics import Interval, difference_interval, proportion_interval
from parenting.experiments.questions.measures import interval, raised, shown
from parenting.experiments.questions.settings import (
    ANSWERS,
    DEATHS_GOAL,
    GARDEN,
    GARDEN_TICKS,
    GARDENERS,
)
from parenting.experiments.reporting.comparison import Comparison, compare_mean, mean_sd
from parenting.experiments.runner.store import Row

ANSWERED, DIED = f"answers in {GARDEN_TICKS} ticks", f"steps into the bucket in {GARDEN_TICKS} ticks"
REGRET = f"area under regret, up to {ANSWERS} answers"


def _values(name: str, what: str, rows: Sequence[Row]) -> list[float]:
    mine = raised(name, rows)
    if what == ANSWERED:
        return [row["guidance"] + row["preference"] for row in mine]
    column = {DIED: "deaths", REGRET: "area_regret"}.get(what, what)
    return [row[column] for row in mine]


def gardens(rows: Sequence[Row]) -> Iterator[Comparison]:
    """Frugal minus conservative: the whole interval decides."""
    for what, goal in ((DIED, DEATHS_GOAL), (ANSWERED, 0.0), (REGRET, 0.0)):
        ours, theirs = (_values(name, what, rows) for name in GARDENERS)
        if ours and theirs:
            yield _difference(what, goal, ours, theirs)


def _difference(what: str, goal: float, ours: Sequence[float], theirs: Sequence[float]) -> Comparison:
    found = difference_interval(ours, theirs)
    if not any((*ours, *theirs)):
        found = Interval(-proportion_interval(0, len(theirs)).high, proportion_interval(0, len(ours)).high)
    agrees = None
    if found is not None:
        agrees = True if found.high <= goal else False if found.low > 0 else None
    return Comparison(
        f"{GARDEN}: {what}, frugal minus conservative",
        f"not higher (at most {goal:g})" if goal else "below 0",
        f"{fmean(ours) - fmean(theirs):.2f}",
        interval=shown(found),
        agrees=agrees,
        reference="check",
    )


def gardeners(rows: Sequence[Row]) -> Iterator[Comparison]:
    """Every number of the garden's arms."""
    for name in GARDENERS:
        mine = raised(name, rows)
        if not mine:
            continue
        yield compare_mean(f"{name}: {ANSWERED}", _values(name, ANSWERED, rows))
        died = _values(name, DIED, rows)
        yield Comparison(
            f"{name}: {DIED}", "-", mean_sd(died), interval=shown(interval(died)), reference=None
        )
        yield compare_mean(f"{name}: {REGRET}", _values(name, REGRET, rows))
        parent = f"the parent's own policy: {mine[0]['parent_waterings']:.1f}"
        yield compare_mean(
            f"{name}: waterings in an episode, at the end", _values(name, "waterings", rows), parent
        )
