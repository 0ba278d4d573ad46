"""Figure 2's arms, compared with the parent, with policy gradients and from stage to stage (Sec. 3.3)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import hypot, log
from statistics import fmean

from parenting.evaluation.rollouts import EPISODES
from parenting.evaluation.statistics import difference_interval, mean_interval
from parenting.experiments.figure2.rows import (
    MANY,
    arms,
    baseline,
    error,
    gradients,
    interval,
    of,
    setting,
    shown,
    waterings,
)
from parenting.experiments.reporting.comparison import SILENT, Comparison, format_interval, mean_sd
from parenting.experiments.runner.store import Row
from parenting.experiments.training.gardens import EPISODE

NEAR = 0.95
"""Near-optimal: at least this share of the waterings that an arm is compared with."""
LAST = 4
"""The paper's last T."""


def compare_arms(rows: Sequence[Row]) -> Iterator[Comparison]:
    """Every arm at every evaluation; then its gain over the stages, and its last stage against gradients."""
    for name, level, inside in arms(rows):
        mine = [row for row in of(rows, name) if (row["level"], row["inside"]) == (level, inside)]
        for queries in dict.fromkeys(row["queries"] for row in mine):
            yield _evaluation(name, [row for row in mine if row["queries"] == queries], rows)
        if name != MANY:
            yield _gain(name, mine)
            yield from _against_gradients(name, mine, gradients(rows, level))


def _evaluation(name: str, mine: Sequence[Row], rows: Sequence[Row]) -> Comparison:
    """All trials after one number of queries.

    The paper claims that an agent is above its parent from T = 1 on; its first and its last stage are judged.
    An arm with other numbers of queries a stage than the paper's is a check.
    """
    first, there = mine[0], [row for row in mine if row["there"]]
    what = f"{setting(first)}: {shown(name)}, T = {first['stage']}, {first['queries']} queries in total"
    if not there:
        note = f"0 of {len(mine)} trials reached this number of queries"
        return Comparison(what, SILENT, SILENT, note=note, reference=None)
    parent, found = baseline(rows, "parent", first), interval(there)
    claimed = parent is not None and first["stage"] in ((1,) if name == MANY else (1, LAST))
    return Comparison(
        what,
        "above its parent" if claimed else SILENT,
        mean_sd(waterings(there)),
        difference="" if parent is None else f"{fmean(waterings(there)) - parent:+.2f} from its parent",
        interval=format_interval(found),
        agrees=found.above(parent) if claimed and parent is not None and found else None,
        note=_note(there, len(mine), baseline(rows, "look-ahead", first)),
        reference=None if not claimed else "check" if name == MANY else "paper",
    )


def _note(there: Sequence[Row], trials: int, exact: float | None) -> str:
    bucket = sum(row["bucket"] for row in there)
    told = [
        "" if exact is None else f"{100 * fmean(waterings(there)) / exact:.0f} % of the look-ahead",
        f"{bucket} of {EPISODES * EPISODE * len(there)} steps into the bucket",
        "" if len(there) == trials else f"{len(there)} of {trials} trials reached this number of queries",
    ]
    return "; ".join(filter(None, told))


def _gain(name: str, mine: Sequence[Row]) -> Comparison:
    """The gain of each trial from T = 1 to the paper's last T, or to the last that the arm has before it."""
    stages = sorted({row["stage"] for row in mine if row["stage"] <= LAST})
    first, last = ({row["trial"]: row for row in _at(mine, stage)} for stage in (stages[0], stages[-1]))
    both = [(first[trial], last[trial]) for trial in last if trial in first]
    gains = [after["waterings"] - before["waterings"] for before, after in both]
    shared = fmean(hypot(before["error"], after["error"]) for before, after in both) if both else 0.0
    found = mean_interval(gains, shared)
    return Comparison(
        f"{setting(mine[0])}: {shown(name)}, gain from T = {stages[0]} to T = {stages[-1]}",
        "above 0",
        mean_sd(gains),
        interval=format_interval(found),
        agrees=found.above(0) if found else None,
    )


def _at(mine: Sequence[Row], stage: int) -> list[Row]:
    """The last evaluation of a stage, of the trials that reached it."""
    last = max(row["queries"] for row in mine if row["stage"] == stage)
    return [row for row in mine if row["queries"] == last and row["there"]]


def _against_gradients(name: str, mine: Sequence[Row], learnt: Sequence[Row]) -> Iterator[Comparison]:
    """At the paper's last T the agent is near-optimal: by how much it exceeds NEAR of policy gradients."""
    there = _at(mine, LAST) if any(row["stage"] == LAST for row in mine) else []
    if not there or not learnt:
        return
    ours, line = waterings(there), [NEAR * value for value in waterings(learnt)]
    found = difference_interval(ours, line, hypot(error(there), NEAR * error(learnt)))
    optimal = fmean(waterings(learnt))
    yield Comparison(
        f"{setting(mine[0])}: {shown(name)}, T = {LAST}, minus {100 * NEAR:.0f} % of policy gradients",
        "above 0: near-optimal",
        f"{fmean(ours) - fmean(line):+.2f}",
        interval=format_interval(found),
        agrees=found.above(0) if found else None,
        note=f"{100 * fmean(ours) / optimal:.0f} % of policy gradients' {optimal:.2f}",
    )


def queries_needed(rows: Sequence[Row]) -> Iterator[Comparison]:
    """The number of queries at T = 1 with which the agent would come near the look-ahead."""
    mine = [row for row in of(rows, MANY) if row["stage"] == 1 and row["there"]]
    exact = baseline(rows, "look-ahead", mine[0]) if mine else None
    if exact is None:
        return
    points = []
    for queries in dict.fromkeys(row["queries"] for row in mine):
        mean = fmean(row["waterings"] for row in mine if row["queries"] == queries)
        points.append((queries, 1 - mean / exact))
    gaps = ", ".join(f"{100 * gap:.1f} % after {queries}" for queries, gap in points)
    yield Comparison(
        f"{setting(mine[0])}: {shown(MANY)}, queries until within "
        f"{100 * (1 - NEAR):.0f} % of the look-ahead, T = 1",
        SILENT,
        extrapolated(points, 1 - NEAR),
        note=f"gap: {gaps}",
        reference=None,
    )


def extrapolated(points: Sequence[tuple[int, float]], gap: float) -> str:
    """The number of queries at which a power law through (queries, gap) reaches a gap, if there is one."""
    done = [queries for queries, found in points if found <= gap]
    if done:
        short = [queries for queries, _ in points if queries < min(done)]
        return f"between {max(short)} and {min(done)}" if short else f"at most {min(done)}"
    if len(points) < 2:
        return "unknown: one evaluation only"
    x, y = [log(queries) for queries, _ in points], [log(found) for _, found in points]
    across = sum((one - fmean(x)) ** 2 for one in x)
    slope = sum((one - fmean(x)) * (other - fmean(y)) for one, other in zip(x, y, strict=True)) / across
    if slope >= 0:
        return "unknown: the gap does not close"
    exponent = fmean(x) + (log(gap) - fmean(y)) / slope
    if exponent > log(1e9):
        return "more than a billion"
    return f"about {10 ** round(exponent / log(10), 1):,.0f}, extrapolated by a power law"
