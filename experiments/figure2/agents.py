"""What Fig. 2's lives come to: against the parent and the look-ahead, from stage to stage, by queries."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, log
from statistics import fmean

from parenting.evaluation.rollouts import EPISODES
from parenting.experiments.figure2.rows import MANY, Range, among, kinds, line, of, watered, where
from parenting.experiments.reporting.comparison import SILENT, Comparison, mean_sd
from parenting.experiments.runner.store import Row
from parenting.experiments.training.gardens import EPISODE

NEAR = 0.95
"""Of the look-ahead's waterings: what counts as coming near."""
LAST = 4
"""The paper's last T."""


def lives(rows: Sequence[Row]) -> list[Comparison]:
    """Every life at every milestone, and whether it rises; not that whose stages are not alike."""
    found = []
    for name, level, inside in kinds(rows):
        mine = [row for row in of(rows, name) if (row["level"], row["inside"]) == (level, inside)]
        for queries in dict.fromkeys(row["queries"] for row in mine):
            found.append(_stage(name, [row for row in mine if row["queries"] == queries], rows))
        if name != MANY:
            found.append(_rise(name, mine))
    return found


def _stage(name: str, mine: Sequence[Row], rows: Sequence[Row]) -> Comparison:
    """All trials at one milestone. At T = 1 the paper's agent is above its parent."""
    first, there = mine[0], [row for row in mine if row["there"]]
    what = f"{where(first)}: {name}, T = {first['stage']}, {first['queries']} queries in all"
    if not there:
        return Comparison(what, SILENT, SILENT, note=f"0 of {len(mine)} trials came so far")
    parent, interval = line(rows, "parent", first), watered(there)
    values = [row["waterings"] for row in there]
    claimed = parent is not None and first["stage"] == 1
    return Comparison(
        what,
        "above its parent" if claimed else SILENT,
        mean_sd(values),
        difference="" if parent is None else f"{fmean(values) - parent:+.2f} on its parent",
        interval=_shown(interval),
        agrees=interval.above(parent) if claimed and parent is not None and interval else None,
        note=_note(there, len(mine), line(rows, "look-ahead", first)),
    )


def _note(there: Sequence[Row], trials: int, ahead: float | None) -> str:
    mean, bucket = fmean(row["waterings"] for row in there), sum(row["bucket"] for row in there)
    said = [
        "" if ahead is None else f"{100 * mean / ahead:.0f} % of the look-ahead",
        f"{bucket} of {EPISODES * EPISODE * len(there)} steps into the bucket",
        "" if len(there) == trials else f"{len(there)} of {trials} trials came so far",
    ]
    return "; ".join(filter(None, said))


def _rise(name: str, mine: Sequence[Row]) -> Comparison:
    """Does it rise with T? From T = 1 to the paper's last T, or the last there is before, trial by trial."""
    stages = sorted({row["stage"] for row in mine if row["stage"] <= LAST})
    first, last = (
        {row["trial"]: row for row in mine if row["stage"] == stage and row["there"]}
        for stage in (stages[0], stages[-1])
    )
    both = [(first[trial], last[trial]) for trial in last if trial in first]
    gains = [after["waterings"] - before["waterings"] for before, after in both]
    interval = among(gains, fmean(hypot(*(row["error"] for row in pair)) for pair in both)) if both else None
    return Comparison(
        f"{where(mine[0])}: {name}, what T = {stages[-1]} adds to T = {stages[0]}",
        "rises",
        mean_sd(gains),
        interval=_shown(interval),
        agrees=interval.above(0) if interval else None,
    )


def _shown(interval: Range | None) -> str:
    return "" if interval is None else str(interval)


def enough(rows: Sequence[Row]) -> list[Comparison]:
    """How many queries at T = 1 would bring the learnt agent near the look-ahead."""
    mine = [row for row in of(rows, MANY) if row["stage"] == 1 and row["there"]]
    ahead = line(rows, "look-ahead", mine[0]) if mine else None
    if ahead is None:
        return []
    points = []
    for queries in dict.fromkeys(row["queries"] for row in mine):
        mean = fmean(row["waterings"] for row in mine if row["queries"] == queries)
        points.append((queries, 1 - mean / ahead))
    said = ", ".join(f"{100 * gap:.1f} % at {queries}" for queries, gap in points)
    return [
        Comparison(
            f"{where(mine[0])}: {MANY}, queries for {100 * (1 - NEAR):.0f} % of the look-ahead, T = 1",
            SILENT,
            extrapolated(points, 1 - NEAR),
            note=f"short of it: {said}",
        )
    ]


def extrapolated(points: Sequence[tuple[int, float]], gap: float) -> str:
    """At how many queries a power law through (queries, gap) comes to a gap; in words where it does not."""
    done = [queries for queries, found in points if found <= gap]
    if done:
        short = [queries for queries, _ in points if queries < min(done)]
        return f"between {max(short)} and {min(done)}" if short else f"{min(done)} or fewer"
    if len(points) < 2:
        return "cannot be said of one number"
    x, y = [log(queries) for queries, _ in points], [log(found) for _, found in points]
    across = sum((one - fmean(x)) ** 2 for one in x)
    slope = sum((one - fmean(x)) * (other - fmean(y)) for one, other in zip(x, y, strict=True)) / across
    if slope >= 0:
        return "cannot be said: the gap does not close"
    exponent = fmean(x) + (log(gap) - fmean(y)) / slope
    if exponent > log(1e9):
        return "more than a billion"
    return f"about {10 ** round(exponent / log(10), 1):,.0f}, by a straight line through the logarithms"
