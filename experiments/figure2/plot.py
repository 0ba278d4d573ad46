"""The plot of Fig. 2: a panel for each garden and parent; below, the ablations, and T = 1 by queries."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Any, Literal

from parenting.experiments.figure2.rows import COVERAGE, MAIN, MANY, arms, of, shown
from parenting.experiments.runner.store import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import SubplotSpec

Style = dict[str, Any]
Outside = Literal["outside upper center", "outside lower center"]
AHEAD: Style = {"color": "#009e73", "marker": "^"}
CURVES: dict[str, Style] = {
    "look-ahead": AHEAD,
    COVERAGE: {"color": "#d55e00", "marker": "D", "linestyle": "-."},
    MAIN: {"color": "#0072b2", "marker": "o"},
}
ABLATIONS = (("#e69f00", "s"), ("#56b4e9", "v"), ("#000000", "P"), ("#cc79a7", "X"), ("#8c6d31", "<"))
"""Colour and marker of the other arms, in turn."""
PARENT, GRADIENTS = "#777777", "#882255"
JITTER = 0.06
"""Distance of arms along T, so that their error bars do not hide each other."""


def draw(figure: Figure, rows: Sequence[Row]) -> None:
    """The main arm by garden and parent, and the other arms below."""
    places = {(name == MAIN, level, inside): None for name, level, inside in arms(rows)}
    everywhere = [place for main, *place in places if main]
    tried = [place for main, *place in places if not main]
    upper = -(-len(everywhere) // 2)
    figure.set_size_inches(9, 1.5 + 2.7 * upper + 3.6 * len(tried))
    grid = figure.add_gridspec(upper + len(tried), 2, height_ratios=[3] * upper + [4] * len(tried))
    panels: list[Axes] = []
    for number, place in enumerate(everywhere):
        room = grid[divmod(number, 2)]
        panels.append(figure.add_subplot(room, sharey=panels[0] if panels else None))
        _everywhere(panels[-1], _at(rows, *place), _title(*place))
    _legend(figure, panels, "outside upper center")
    below: list[Axes] = []
    for row, place in enumerate(tried, start=upper):
        below += _below(figure, grid[row, :], _at(rows, *place), _title(*place))
    _legend(figure, below, "outside lower center")


def _below(figure: Figure, room: SubplotSpec, rows: Sequence[Row], title: str) -> list[Axes]:
    """The ablations, and next to them T = 1 by queries, if there is such an arm."""
    growing, grid = of(rows, MANY), room.subgridspec(1, 3)
    panels = [figure.add_subplot(grid[: 2 if growing else 3])]
    _ablations(panels[0], rows, title)
    if growing:
        panels.append(figure.add_subplot(grid[2]))
        _by_queries(panels[1], growing, rows)
    return panels


def _at(rows: Sequence[Row], level: str, inside: str) -> list[Row]:
    """The rows of a garden and parent, without trials that did not reach their number of queries."""
    here = [row for row in rows if (row["level"], row.get("inside", inside)) == (level, inside)]
    return [row for row in here if row.get("there", True)]


def _title(level: str, inside: str) -> str:
    return f"{level}, parent {inside} inside"


def _legend(figure: Figure, panels: Sequence[Axes], where: Outside) -> None:
    """One legend for several panels, each name once."""
    known: dict[str, Any] = {}
    for axes in panels:
        handles, names = axes.get_legend_handles_labels()
        known = dict(zip(names, handles, strict=True)) | known
    figure.legend(known.values(), known.keys(), loc=where, ncols=3, fontsize=8)


# The panels


def _everywhere(axes: Axes, rows: Sequence[Row], title: str) -> None:
    _parent(axes, rows)
    _gradients(axes, of(rows, "policy gradients"))
    for name, style in CURVES.items():
        _curve(axes, name, of(rows, name), style)
    _finish(axes, title)


def _ablations(axes: Axes, rows: Sequence[Row], title: str) -> None:
    """All arms with stages of equal length, and the look-ahead."""
    names = [name for name in dict.fromkeys(row["of"] for row in rows if "queries" in row) if name != MANY]
    _parent(axes, rows)
    _curve(axes, "look-ahead", of(rows, "look-ahead"), AHEAD)
    for number, name in enumerate(names):
        colour, mark = ABLATIONS[number % len(ABLATIONS)]
        style = CURVES.get(name, {"color": colour, "marker": mark, "linewidth": 1.0})
        _curve(axes, name, of(rows, name), style, JITTER * (number - (len(names) - 1) / 2))
    _finish(axes, f"ablations: {title}")


def _by_queries(axes: Axes, rows: Sequence[Row], lines: Sequence[Row]) -> None:
    """T = 1 after increasing numbers of queries, on a logarithmic axis."""
    first = [row for row in rows if row["stage"] == 1]
    groups = {queries: _values(first, queries) for queries in sorted({row["queries"] for row in first})}
    _parent(axes, lines)
    for row in of(lines, "look-ahead"):
        if row["stage"] == 1:
            axes.axhline(row["waterings"], color=AHEAD["color"], label="look-ahead")
    _bars(axes, shown(MANY), groups, {"color": "#332288", "marker": "s"})
    axes.set_xscale("log")
    axes.set_xticks(list(groups), [str(queries) for queries in groups], fontsize=7)
    axes.minorticks_off()
    axes.set_xlabel("queries at T = 1")
    axes.set_title("T = 1 by queries", fontsize=10)


def _finish(axes: Axes, title: str) -> None:
    low, high = axes.get_xlim()
    axes.set_xticks([stage for stage in range(1, 20) if low <= stage <= high])
    axes.set_xlabel("clip length T")
    axes.set_ylabel("waterings in 10 steps")
    axes.set_title(title, fontsize=10)


# The parts of a panel


def _parent(axes: Axes, rows: Sequence[Row]) -> None:
    for row in of(rows, "parent"):
        axes.axhline(row["waterings"], color=PARENT, linestyle=":", label="parent")


def _gradients(axes: Axes, rows: Sequence[Row]) -> None:
    """Their mean after the last gradient step, and a band of one standard deviation over trials."""
    last = max((row["steps"] for row in rows), default=0)
    values = [row["waterings"] for row in rows if row["steps"] == last]
    if values:
        mean, off = fmean(values), stdev(values) if len(values) > 1 else 0.0
        axes.axhline(mean, color=GRADIENTS, linestyle="--", label=f"policy gradients, {last} steps")
        axes.axhspan(mean - off, mean + off, color=GRADIENTS, alpha=0.15, linewidth=0)


def _curve(axes: Axes, name: str, rows: Sequence[Row], style: Style, offset: float = 0.0) -> None:
    """By T, at the last evaluation of each stage."""
    groups = {}
    for stage in sorted({row["stage"] for row in rows}):
        mine = [row for row in rows if row["stage"] == stage]
        groups[stage + offset] = _values(mine, max(row.get("queries", 0) for row in mine))
    label = shown(name)
    if name == MAIN and rows:
        label = f"{label}, {max(row['queries'] for row in rows if row['stage'] == 1)} queries a stage"
    _bars(axes, label, groups, style)


def _values(rows: Sequence[Row], queries: int) -> list[float]:
    return [row["waterings"] for row in rows if row.get("queries", 0) == queries]


def _bars(axes: Axes, name: str, groups: dict[Any, list[float]], style: Style) -> None:
    """Means over trials, with error bars of one standard deviation."""
    if groups:
        means = [fmean(values) for values in groups.values()]
        off = [stdev(values) if len(values) > 1 else 0.0 for values in groups.values()]
        axes.errorbar(
            list(groups), means, off if any(off) else None, capsize=2, markersize=5, label=name, **style
        )
