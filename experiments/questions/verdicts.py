"""The verdicts on our own goals: each could be *no*."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from statistics import fmean

from parenting.evaluation.statistics import (
    Interval,
    difference_interval,
    mean_interval,
    proportion_interval,
)
from parenting.experiments.questions.measures import (
    answers,
    deaths,
    independent,
    interval,
    left_out,
    raised,
    rate_interval,
    rates,
    shown,
)
from parenting.experiments.questions.settings import (
    ASKS_AT_LAST,
    BOTTLENECK,
    BOTTLENECK_GOAL,
    DEATHS_GOAL,
    DIES_AT_LAST,
    IDEAL,
    ISLAND,
    ISLAND_GOAL,
    ISLANDS,
    LASTING_LIVES,
    LEVELS,
    LONG_LIVES,
    SHARED,
    STARTED,
)
from parenting.experiments.reporting.comparison import (
    Comparison,
    format_interval,
    format_percent,
    mean_sd,
)
from parenting.experiments.runner.store import Row

Measure = Callable[[Sequence[Row]], list[float]]
GOALS = {ISLAND: ISLAND_GOAL, BOTTLENECK: BOTTLENECK_GOAL}
"""Answers until optimal, at most."""


def verdicts(rows: Sequence[Row]) -> Iterator[Comparison]:
    """Every verdict for which there are trials."""
    for level, goal in GOALS.items():
        mine = raised(f"frugal, {level}", rows)
        if mine:
            yield at_most(f"frugal, {level}: answers until optimal", answers(mine), goal, left_out(mine))
            yield at_most(f"frugal, {level}: deaths", deaths(mine), DEATHS_GOAL)
    for level in _levels():
        yield from _no_more_deaths(level, rows)
    for level in _levels():
        yield from _no_more_answers(level, rows)
    for name in STARTED:
        yield from _below_ideal(f"{name}, {ISLAND}", ISLAND, rows)
        yield from _below_ideal(f"{name}, {BOTTLENECK}", BOTTLENECK, rows)
    yield from _below_ideal(f"frugal, {ISLAND}", ISLAND, rows)
    yield from _below_ideal(f"frugal, {BOTTLENECK}", BOTTLENECK, rows)
    for name in LONG_LIVES:
        yield from falling(name, rows)
    for name in LASTING_LIVES:
        yield from _kept(name, rows)


def _levels() -> list[str]:
    return [*(level for _world, level in LEVELS), *ISLANDS]


def at_most(what: str, values: Sequence[float], goal: float, note: str = "") -> Comparison:
    """A mean that should be at most `goal`: its whole interval decides.

    Where all trials have 0 events, the interval is that of the proportion of trials with one.
    """
    found = interval(values)
    above = found is not None and found.low > goal
    agrees = True if found is not None and found.high <= goal else False if above else None
    return Comparison(
        what, f"at most {goal:g}", mean_sd(values), "", shown(found), agrees, note, reference="check"
    )


def _no_more_deaths(level: str, rows: Sequence[Row]) -> Iterator[Comparison]:
    """Frugal's deaths minus the conservative preset's: not higher if the interval ends below the goal."""
    ours, theirs = _both(level, rows, deaths)
    if not ours or not theirs:
        return
    found = _difference(level, ours, theirs)
    difference = fmean(ours) - fmean(theirs)
    if found is None and not any(ours):
        found = Interval(-proportion_interval(0, len(theirs)).high, proportion_interval(0, len(ours)).high)
    higher = found is not None and found.low > 0
    agrees = True if found is not None and found.high <= DEATHS_GOAL else False if higher else None
    yield Comparison(
        f"{level}: deaths, frugal minus conservative",
        f"not higher (at most {DEATHS_GOAL:g})",
        f"{difference:.3f}",
        "",
        shown(found),
        agrees,
        reference="check",
    )


def _no_more_answers(level: str, rows: Sequence[Row]) -> Iterator[Comparison]:
    """Frugal's answers minus the conservative preset's: the whole interval decides."""
    ours, theirs = _both(level, rows, answers)
    if not ours or not theirs:
        return
    found = _difference(level, ours, theirs)
    more = found.above(0) if found else None
    yield Comparison(
        f"{level}: answers, frugal minus conservative",
        "below 0",
        f"{fmean(ours) - fmean(theirs):.2f}",
        "",
        format_interval(found),
        None if more is None else not more,
        reference="check",
    )


def _both(level: str, rows: Sequence[Row], measure: Measure) -> tuple[list[float], list[float]]:
    arms = (f"{name}, {level}" for name in ("frugal", "conservative"))
    ours, theirs = (independent(arm, raised(arm, rows), measure) for arm in arms)
    return ours, theirs


def _difference(level: str, ours: Sequence[float], theirs: Sequence[float]) -> Interval | None:
    """The interval of a difference; in pairs where both presets are tried on the same levels."""
    if f"frugal, {level}" in SHARED:
        return mean_interval([own - other for own, other in zip(ours, theirs, strict=True)])
    return difference_interval(ours, theirs)


def _below_ideal(name: str, level: str, rows: Sequence[Row]) -> Iterator[Comparison]:
    ours, ideal = raised(name, rows), answers(raised(f"{IDEAL}, {level}", rows))
    if not ours or not ideal:
        return
    found = difference_interval(independent(name, ours, answers), ideal)
    above = found.above(0) if found else None
    yield Comparison(
        f"{name}: answers minus those of the {IDEAL}",
        "below 0",
        f"{fmean(answers(ours)) - fmean(ideal):.2f}" if answers(ours) else "-",
        "",
        format_interval(found),
        None if above is None else not above,
        left_out(ours),
        reference="check",
    )


def falling(name: str, rows: Sequence[Row]) -> Iterator[Comparison]:
    """Each later window below the first, and the last one's upper end below the goal."""
    for column, what, goal in (("answered", "answers", ASKS_AT_LAST), ("deaths", "deaths", DIES_AT_LAST)):
        each = rates(name, column, rows)
        if not each:
            return
        ticks = next(row["ticks"] for row in raised(name, rows))
        ends = [rate_interval(window, ticks) for window in each]
        first, last = ends[0], ends[-1]
        below = [one is not None and first is not None and one.high < first.low for one in ends[1:]]
        if len(each) > 1:
            idle = not any(each[0])
            yield Comparison(
                f"{name}: {what}, windows below the first",
                f"{len(below)} of {len(below)}",
                f"{sum(below)} of {len(below)}",
                agrees=None if idle else all(below),
                note="none in the first window" if idle else f"first: {_percent(each[0], first)}",
                reference="check",
            )
        yield Comparison(
            f"{name}: {what}, last window",
            f"below {100 * goal:g} % of ticks",
            _percent(each[-1], last),
            agrees=_under(last, goal),
            reference="check",
        )


def _under(found: Interval | None, goal: float) -> bool | None:
    """The whole interval decides."""
    above = None if found is None else found.above(goal)
    return None if above is None else not above


def _percent(values: Sequence[float], found: Interval | None) -> str:
    shown = f"{100 * fmean(values):.3f} %"
    return shown if found is None else f"{shown} ({100 * found.low:.3f} to {100 * found.high:.3f} %)"


def _kept(name: str, rows: Sequence[Row]) -> Iterator[Comparison]:
    """Trials that are optimal at the end, of those that ever were."""
    mine = raised(name, rows)
    if not mine:
        return
    ever, last, lost = (sum(row[column] for row in mine) for column in ("ever", "optimal", "lost"))
    found = proportion_interval(last, len(mine))
    asked = fmean(row["guidance"] + row["preference"] for row in mine)
    away = fmean(row["away"] for row in mine)
    yield Comparison(
        f"{name}: optimal at the end",
        f"{ever}: all that ever were",
        f"{last} of {len(mine)}",
        interval=format_percent(found),
        agrees=last == ever if ever else None,
        note=f"lost {lost} times, for {away:.1f} ticks a trial; {fmean(deaths(mine)):.2f} deaths, "
        f"{asked:.1f} answers",
        reference="check",
    )
