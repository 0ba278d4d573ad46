"""Rows on parents who err: deaths, questions and optimal policies of every arm, and checks between arms."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import sqrt
from statistics import fmean, stdev

from scipy import special

from parenting.evaluation.statistics import TAIL, count_interval, difference_interval
from parenting.experiments.fallible.settings import (
    ARMS,
    BOTH,
    BOTTLENECK,
    CONFIRM,
    CONFIRMED,
    DOUBTED,
    FRUGAL,
    ISLAND,
    PRESETS,
    RELABEL,
    REPEATED,
    SLIPS,
    THRICE,
    TODAY,
    Arm,
    noisy,
)
from parenting.experiments.reporting.comparison import (
    NEVER,
    SILENT,
    Comparison,
    compare_count,
    compare_mean,
    format_interval,
    mean_sd,
)
from parenting.experiments.runner.store import Row

Rows = Mapping[str, Sequence[Row]]
"""The rows of every arm."""
DEATHS, QUESTIONS, UNTIL, UNTIL_DEATHS = (
    "deaths",
    "questions",
    "questions until optimal",
    "deaths until optimal",
)
AT_END, LOST = "optimal at the end", "optimal once, not at the end"
PROBED = 60
"""Trials of a first probe, made while nothing of this experiment was there yet."""


def by_arm(rows: Sequence[Row]) -> Rows:
    """The rows of each arm."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(row["of"], []).append(row)
    return found


def values(rows: Sequence[Row], measure: str) -> list[float]:
    """One value a trial; until optimal only of trials whose policy was optimal once."""
    once = [row for row in rows if row["optimal_at"]]
    match measure:
        case "deaths":
            return [row["deaths"] for row in rows]
        case "questions":
            return [row["guidance"] + row["preference"] for row in rows]
        case "questions until optimal":
            return [row["optimal_queries"] for row in once]
        case "deaths until optimal":
            return [row["optimal_deaths"] for row in once]
    raise ValueError(f"There is no measure {measure}.")


def findings(rows: Rows) -> list[Comparison]:
    """All rows of the page: checks first."""
    checks = [
        *_robust(rows),
        *_relabelled(rows),
        *_confirmed(rows),
        *_rates(rows),
        *_kinds(rows),
        *_lost(rows),
        *_probes(rows),
    ]
    return [*checks, *_misconceptions(rows), *(one for name in rows for one in _arm(name, rows[name]))]


def _arm(name: str, mine: Sequence[Row]) -> Iterator[Comparison]:
    """An arm: deaths and questions from the start, and its policies."""
    once = [row for row in mine if row["optimal_at"]]
    since = fmean(row["deaths"] - row["optimal_deaths"] for row in once) if once else 0
    ends = ARMS[name].level != "garden"
    yield compare_mean(
        f"{name}: {DEATHS}",
        values(mine, DEATHS),
        f"{since:.2f} since the first optimal policy" if once else "",
    )
    yield compare_mean(f"{name}: {QUESTIONS}", values(mine, QUESTIONS))
    if once:
        yield compare_mean(f"{name}: {UNTIL}", values(mine, UNTIL))
    if ends:
        hits = sum(row["optimal"] for row in mine)
        note = f"{len(once)} were optimal once"
        yield compare_count(f"{name}: {AT_END}", SILENT, hits, len(mine), note)


def _less(rows: Rows, one: Arm, other: Arm, measure: str, expected: str = "below 0") -> Iterator[Comparison]:
    """The difference of two arms, where both were run."""
    if one.name in rows and other.name in rows:
        yield _difference(rows, one, other, measure, expected)


def _difference(rows: Rows, one: Arm, other: Arm, measure: str, expected: str) -> Comparison:
    mine, theirs = (values(rows[arm.name], measure) for arm in (one, other))
    interval = difference_interval(mine, theirs)
    above = interval.above(0) if interval else None
    return Comparison(
        what=f"{one.name} minus {other.name}: {measure}",
        paper=expected,
        ours=f"{fmean(mine) - fmean(theirs):.2f}" if mine and theirs else "-",
        interval=format_interval(interval),
        agrees=None if above is None or expected == SILENT else above == (expected == "above 0"),
        reference=None if expected == SILENT else "check",
    )


def _robust(rows: Rows) -> Iterator[Comparison]:
    """Ways to withstand slips: fewer deaths, and fewer questions where that is claimed."""
    for level in (ISLAND, BOTTLENECK):
        for eps in SLIPS:
            today = Arm(level, TODAY, noisy(eps))
            for way in (CONFIRM, THRICE, BOTH):
                yield from _less(rows, Arm(level, way, noisy(eps)), today, DEATHS)
            both, frugal = (Arm(level, way, noisy(eps)) for way in (BOTH, FRUGAL))
            yield from _less(rows, both, frugal, DEATHS)
            yield from _less(rows, both, today, UNTIL)
            confirmed, thrice = (Arm(level, way, noisy(eps)) for way in (CONFIRM, THRICE))
            yield from _less(rows, confirmed, thrice, UNTIL)
            yield from _less(rows, Arm(level, REPEATED, noisy(eps)), today, DEATHS, "above 0")


def _relabelled(rows: Rows) -> Iterator[Comparison]:
    """Answers that are doubted in later visits, against the same agents that never doubt them."""
    for level in (ISLAND, BOTTLENECK):
        for doubting, sure in ((RELABEL, FRUGAL), (DOUBTED, BOTH)):
            one, other = (Arm(level, way, noisy(0.1)) for way in (doubting, sure))
            yield from _less(rows, one, other, DEATHS)
            yield from _less(rows, one, other, QUESTIONS, "above 0")


def _confirmed(rows: Rows) -> Iterator[Comparison]:
    """The ways that a screening had picked, on fresh trials until optimal."""
    for level in (ISLAND, BOTTLENECK):
        today, *picked = (Arm(level, way, noisy(0.1), fresh=True) for way in CONFIRMED)
        for arm in picked:
            yield from _less(rows, arm, today, DEATHS)
        for arm in picked[1:]:
            yield from _less(rows, arm, today, QUESTIONS)


def _rates(rows: Rows) -> Iterator[Comparison]:
    """More errors, more deaths: the highest rate against a perfect parent."""
    for level in (ISLAND, BOTTLENECK):
        for preset in PRESETS:
            most, none = (Arm(level, preset, noisy(eps)) for eps in (0.4, 0.0))
            yield from _less(rows, most, none, DEATHS, "above 0")
        some, none = (Arm(level, TODAY, noisy(eps)) for eps in (0.1, 0.0))
        yield from _less(rows, some, none, DEATHS, "above 0")


def _kinds(rows: Rows) -> Iterator[Comparison]:
    """Errors where the clips are alike against as many anywhere; and whether votes help against them."""
    for eps in SLIPS:
        alike, anywhere = (Arm(ISLAND, TODAY, parent) for parent in (f"likeness:{eps:g}", noisy(eps)))
        yield from _less(rows, alike, anywhere, DEATHS, "above 0")
        yield from _less(rows, Arm(ISLAND, CONFIRM, alike.parent), alike, DEATHS)


def _lost(rows: Rows) -> Iterator[Comparison]:
    """Policies that were optimal and are not any more."""
    for level in (ISLAND, BOTTLENECK):
        for way, eps in (
            (TODAY, 0.0),
            (TODAY, 0.1),
            (CONFIRM, 0.1),
            (FRUGAL, 0.1),
            (BOTH, 0.1),
            (RELABEL, 0.1),
            (DOUBTED, 0.1),
        ):
            name = Arm(level, way, noisy(eps)).name
            once = [row for row in rows.get(name, ()) if row["optimal_at"]]
            if once:
                lost = sum(not row["optimal"] for row in once)
                yield _as_check(compare_count(f"{name}: {LOST}", NEVER, lost, len(once)))


def _as_check(row: Comparison) -> Comparison:
    return Comparison(**{**row.plain(), "reference": "check"})


PROBES = (
    (ISLAND, TODAY, 0.0, 0.02, 27),
    (ISLAND, TODAY, 0.1, 0.20, 27),
    (ISLAND, TODAY, 0.2, 0.72, 36),
    (ISLAND, REPEATED, 0.1, 0.33, None),
    (ISLAND, REPEATED, 0.2, 1.28, None),
    (ISLAND, CONFIRM, 0.1, 0.03, 40),
    (ISLAND, CONFIRM, 0.2, 0.23, 51),
    (ISLAND, THRICE, 0.1, 0.05, 48),
    (BOTTLENECK, TODAY, 0.1, 2.63, 63.9),
    (ISLAND, DOUBTED, 0.1, 0.0, 15.9),
    (BOTTLENECK, DOUBTED, 0.1, 0.10, 42.7),
)
"""Level, way, rate of slips, and the first probe's deaths and questions until optimal."""


def _probes(rows: Rows) -> Iterator[Comparison]:
    for level, way, eps, deaths, questions in PROBES:
        name = Arm(level, way, noisy(eps)).name
        if name in rows:
            yield from _probe(f"{name}: {UNTIL_DEATHS}", values(rows[name], UNTIL_DEATHS), deaths)
            yield from _probe(f"{name}: {UNTIL}", values(rows[name], UNTIL), questions)


def _probe(what: str, found: Sequence[float], probed: float | None) -> Iterator[Comparison]:
    """A number of the first probe; it agrees if it lies where 95 % of means of so many of our trials do."""
    if probed is None or len(found) < 2:
        return
    room = float(special.stdtrit(len(found) - 1, TAIL)) * stdev(found) * sqrt(1 / len(found) + 1 / PROBED)
    yield Comparison(
        what=what,
        paper=f"{probed:g} (a first probe)",
        ours=mean_sd(found),
        difference=f"{fmean(found) - probed:+.2f}",
        interval=format_interval(count_interval(found)),
        agrees=abs(fmean(found) - probed) <= room if room else None,
        reference="check",
    )


def _misconceptions(rows: Rows) -> Iterator[Comparison]:
    """Nothing is expected of votes here."""
    today = Arm(ISLAND, TODAY, "misconceived:0.1")
    for way in (CONFIRM, BOTH):
        yield from _less(rows, Arm(ISLAND, way, today.parent), today, DEATHS, SILENT)
