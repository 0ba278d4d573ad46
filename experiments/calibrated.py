"""What the calibration found: the nearest setting of each layout, Table 1 with the nearest, and a drawing."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from statistics import fmean
from typing import TYPE_CHECKING, Any

from experiments import table1
from experiments.findings import Finding, spread
from experiments.matching import (
    BY_REWARD,
    DEATHS,
    DIRECT,
    KNOBS,
    QUERIES,
    TRADITIONAL,
    Found,
    Target,
    search,
)
from experiments.pieces import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WANTED = "47 +- 14, 51, 2300 +- 700"
COLOURS = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7")
"""Okabe and Ito's, one a layout."""


def findings(rows: Sequence[Row]) -> list[Finding]:
    """Table 1 with the nearest setting, whether all three numbers are met, and the search by layout."""
    found = search(rows)
    best = found[0]
    cells = [cell for one in table1.ALGORITHMS for cell in table1.cells(one, rows)]
    return [_chosen(best), *cells, _together(rows), *map(_nearest, found)]


def _chosen(best: Found) -> Finding:
    return Finding("the setting taken", "lost", f"{best.layout}: {_said(best)}")


def _said(found: Found) -> str:
    return ", ".join(f"{name} {found.direct[name]}" for name in KNOBS) + f"; entropy {found.entropy}"


def _nearest(found: Found) -> Finding:
    direct, rewarded = (_done(rows) for rows in (found.rows, found.rewarded))
    means = [
        spread([row[column] for row in some])
        for some, column in ((direct, "deaths"), (direct, "preference"), (rewarded, "deaths"))
    ]
    left = len(found.rows) - len(direct), len(found.rewarded) - len(rewarded)
    far = f"distance {found.distance:.1f}" if isfinite(found.distance) else "too many unfinished"
    return Finding(
        f"search, nearest on {found.layout}: deaths, queries, deaths by reward",
        WANTED,
        ", ".join(means),
        far,
        note=f"{_said(found)}; unfinished {left[0]} of {len(found.rows)}, {left[1]} of {len(found.rewarded)}",
    )


def _together(rows: Sequence[Row]) -> Finding:
    """Whether one setting brings all three numbers, each within the paper's deviation."""
    met = {
        f"{name}: {target.column}": _meets([row for row in rows if row["of"] == name], target)
        for name, target in (("direct", DEATHS), ("direct", QUERIES), ("traditional", BY_REWARD))
    }
    missed = [what for what, holds in met.items() if not holds]
    return Finding(
        "all three numbers at once, each within the paper's deviation over trials",
        "yes",
        "no: " + ", ".join(missed) if missed else "yes",
        agrees=not missed,
        note="14 stands in for the deviation of the 51, which is lost",
    )


def _meets(rows: Sequence[Row], target: Target) -> bool:
    values = [row[target.column] for row in _done(rows)]
    return bool(values) and abs(fmean(values) - target.mean) <= target.deviation


def _done(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row["finished"]]


def scatter(figure: Figure, rows: Sequence[Row]) -> None:
    """Every setting of the search, and the paper's numbers."""
    left, right = figure.subplots(1, 2)
    layouts = dict.fromkeys(row["layout"] for row in rows if "layout" in row)
    for layout, colour in zip(layouts, COLOURS, strict=False):
        mine = [row for row in rows if row.get("layout") == layout]
        x, y = _means(mine, DIRECT, KNOBS, "preference", "deaths")
        left.scatter(x, y, color=colour, label=layout, s=16)
        x, y = _means(mine, TRADITIONAL, ("entropy",), "entropy", "deaths")
        right.plot(x, y, "o-", color=colour, markersize=4)
    left.errorbar(QUERIES.mean, DEATHS.mean, yerr=DEATHS.deviation, fmt="k*", capsize=3, label="paper")
    right.axhspan(
        BY_REWARD.mean - BY_REWARD.deviation,
        BY_REWARD.mean + BY_REWARD.deviation,
        color="black",
        alpha=0.12,
        label="paper",
    )
    _name(left, "preference queries", "deaths of direct policy learning")
    _name(right, "weight of entropy", "deaths of policy gradients")


def _name(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_ylim(bottom=0)
    axes.legend()


def _means(
    rows: Sequence[Row], of: str, knobs: Sequence[str], x: str, y: str
) -> tuple[list[float], list[float]]:
    """Two means of every setting's finished trials, where there are any."""
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        if row["of"] == of and row["finished"]:
            groups.setdefault(tuple(row[knob] for knob in knobs), []).append(row)
    each = [(fmean(row[x] for row in some), fmean(row[y] for row in some)) for some in groups.values()]
    return [one for one, _ in each], [other for _, other in each]
