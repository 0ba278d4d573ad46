"""What the calibration found: the nearest setting of each layout, and Table 1 with the nearest of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite
from statistics import fmean

from parenting.experiments.calibrate.distance import (
    BY_REWARD,
    DEATHS,
    HYPERPARAMETERS,
    QUERIES,
    Found,
    Target,
    search,
)
from parenting.experiments.reporting.comparison import Comparison, mean_sd
from parenting.experiments.runner.store import Row
from parenting.experiments.table1.report import ALGORITHMS, Algorithm, born, cells, order

WANTED = "47 +- 14, 51, 2300 +- 700"
FITTED = ("traditional", "direct")
"""The algorithms whose numbers the search aims at."""


def findings(rows: Sequence[Row]) -> list[Comparison]:
    """Table 1 with the nearest setting, whether all three numbers are met, and the search by layout."""
    found = search(rows)
    best = found[0]
    table = [_marked(one, cell) for one in ALGORITHMS for cell in cells(one, rows)]
    ordered = [_marked(one, row) for one, row in zip(ALGORITHMS[1:], order(rows), strict=True)]
    return [_chosen(best), *table, _together(rows), *ordered, born(rows), *map(_nearest, found)]


def _marked(one: Algorithm, row: Comparison) -> Comparison:
    """A row on an algorithm, or on how it differs from the one before it; it says whether it was aimed at."""
    mark = "fitted: the search aims at it" if one.name in FITTED else "not fitted"
    return replace(row, note="; ".join(filter(None, (mark, row.note))))


def _chosen(best: Found) -> Comparison:
    return Comparison("the setting taken", "lost", f"{best.layout}: {_said(best)}")


def _said(found: Found) -> str:
    return (
        ", ".join(f"{name} {found.direct[name]}" for name in HYPERPARAMETERS) + f"; entropy {found.entropy}"
    )


def _nearest(found: Found) -> Comparison:
    direct, rewarded = (_done(rows) for rows in (found.rows, found.rewarded))
    means = [
        mean_sd([row[column] for row in some])
        for some, column in ((direct, "deaths"), (direct, "preference"), (rewarded, "deaths"))
    ]
    left = len(found.rows) - len(direct), len(found.rewarded) - len(rewarded)
    far = f"distance {found.distance:.1f}" if isfinite(found.distance) else "too many unfinished"
    return Comparison(
        f"search, nearest on {found.layout}: deaths, queries, deaths by reward",
        WANTED,
        ", ".join(means),
        far,
        note=f"{_said(found)}; unfinished {left[0]} of {len(found.rows)}, {left[1]} of {len(found.rewarded)}",
    )


def _together(rows: Sequence[Row]) -> Comparison:
    """Whether one setting brings all three numbers, each within the paper's deviation."""
    met = {
        f"{name}: {target.column}": _meets([row for row in rows if row["of"] == name], target)
        for name, target in (("direct", DEATHS), ("direct", QUERIES), ("traditional", BY_REWARD))
    }
    missed = [what for what, holds in met.items() if not holds]
    return Comparison(
        "all three numbers at once, each within the paper's deviation over trials",
        "yes",
        "no: " + ", ".join(missed) if missed else "yes",
        agrees=not missed,
        note="fitted: the search aims at all three; 14 stands in for the deviation of the 51, which is lost",
    )


def _meets(rows: Sequence[Row], target: Target) -> bool:
    values = [row[target.column] for row in _done(rows)]
    return bool(values) and abs(fmean(values) - target.mean) <= target.deviation


def _done(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row["finished"]]
