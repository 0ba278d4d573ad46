"""Plot of the calibration search: every setting, the excluded ones, and the paper's numbers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import isfinite
from statistics import fmean
from typing import TYPE_CHECKING, Any, NamedTuple

from parenting.experiments.calibrate.distance import (
    BY_REWARD,
    DEATHS,
    DIRECT,
    HYPERPARAMETERS,
    QUERIES,
    TRADITIONAL,
    distance,
    grouped,
    search,
)
from parenting.experiments.runner.store import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7")
"""Okabe and Ito's, one a layout."""


class Point(NamedTuple):
    """A setting, by means of its finished trials."""

    x: float
    y: float
    included: bool  # enough of its trials finished


def scatter(figure: Figure, rows: Sequence[Row]) -> None:
    """Every setting of the search, and the paper's numbers."""
    figure.set_size_inches(8, 5)
    left, right = figure.subplots(1, 2)
    _paper(left, right)
    best = search(rows)[0]
    for layout, colour in zip(dict.fromkeys(_layouts(rows)), COLOURS, strict=False):
        mine = [row for row in rows if row.get("layout") == layout]
        _dots(
            left,
            _points(grouped(mine, DIRECT, HYPERPARAMETERS).values(), "preference", "deaths"),
            colour,
            layout,
        )
        rewarded = grouped(mine, TRADITIONAL, ("entropy",))
        _dots(right, _points(rewarded.values(), "entropy", "deaths"), colour)
        _crosses(right, rewarded, colour)
    _mark_selected(left, best.rows, "preference", "deaths")
    _mark_selected(right, best.rewarded, "entropy", "deaths")
    _legend_entries(left)
    _name(left, "preference queries", "deaths of direct policy learning")
    _name(right, "entropy coefficient", "deaths of policy gradients")
    figure.legend(loc="outside lower center", ncols=4, fontsize=8)


def _layouts(rows: Sequence[Row]) -> Iterator[str]:
    return (row["layout"] for row in rows if "layout" in row)


def _paper(left: Axes, right: Axes) -> None:
    """The paper's numbers; for the lost standard deviation of the queries, that of the deaths."""
    low, high = BY_REWARD.mean - BY_REWARD.deviation, BY_REWARD.mean + BY_REWARD.deviation
    right.axhspan(low, high, color="black", alpha=0.12)
    said = "the paper (14 is used for the lost deviation of the 51)"
    stand_in = QUERIES.deviation
    left.errorbar(
        QUERIES.mean, DEATHS.mean, xerr=stand_in, yerr=DEATHS.deviation, fmt="k*", capsize=3, label=said
    )


def _points(settings: Iterable[list[Row]], x: str, y: str) -> Iterator[Point]:
    """Each setting with at least one finished trial."""
    for some in settings:
        done = [row for row in some if row["finished"]]
        if done:
            included = isfinite(distance(some))
            yield Point(fmean(row[x] for row in done), fmean(row[y] for row in done), included)


def _dots(axes: Axes, points: Iterable[Point], colour: str, layout: str | None = None) -> None:
    for one in points:
        face = colour if one.included else "none"
        axes.scatter(one.x, one.y, s=18, facecolors=face, edgecolors=colour)
    if layout:
        axes.scatter([], [], s=18, color=colour, label=layout)


def _crosses(axes: Axes, settings: Mapping[tuple[Any, ...], list[Row]], colour: str) -> None:
    """At the bottom: entropy coefficients with which no trial finished, side by side for several layouts."""
    for (weight,), some in settings.items():
        if not any(row["finished"] for row in some):
            place = weight + 0.015 * COLOURS.index(colour)
            axes.plot(place, 0.02, "x", color=colour, markersize=5, transform=axes.get_xaxis_transform())


def _mark_selected(axes: Axes, rows: list[Row], x: str, y: str) -> None:
    for one in _points([rows], x, y):
        axes.scatter(one.x, one.y, s=110, facecolors="none", edgecolors="black")


def _legend_entries(axes: Axes) -> None:
    """Empty series for the legend."""
    axes.scatter([], [], s=18, facecolors="none", edgecolors="grey", label="excluded: too many unfinished")
    axes.scatter([], [], s=20, marker="x", color="grey", label="no trial finished")
    axes.scatter([], [], s=110, facecolors="none", edgecolors="black", label="selected")


def _name(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_ylim(bottom=0)
