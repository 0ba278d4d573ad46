"""The drawing of Fig. 2: a panel for each garden and parent; below, the levers, and a sample that grows."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Any, Literal

from parenting.experiments.figure2.rows import LIVED, MANY, kinds, of
from parenting.experiments.runner.store import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import SubplotSpec

Look = dict[str, Any]
Outside = Literal["outside upper center", "outside lower center"]
AHEAD: Look = {"color": "#009e73", "marker": "^"}
CURVES: dict[str, Look] = {
    "look-ahead": AHEAD,
    "coverage": {"color": "#d55e00", "marker": "D", "linestyle": "-."},
    LIVED: {"color": "#0072b2", "marker": "o"},
}
LEVERS = (("#e69f00", "s"), ("#56b4e9", "v"), ("#000000", "P"), ("#cc79a7", "X"), ("#8c6d31", "<"))
"""Colour and mark of the other lives, by turns."""
PARENT, GRADIENTS = "#777777", "#882255"
ASIDE = 0.06
"""How far apart lives stand along T, so that their bars do not hide each other."""


def draw(figure: Figure, rows: Sequence[Row]) -> None:
    """What is lived everywhere, by garden and parent; and what is tried in one of them, below."""
    places = {(name == LIVED, level, inside): None for name, level, inside in kinds(rows)}
    everywhere = [place for lived, *place in places if lived]
    tried = [place for lived, *place in places if not lived]
    upper = -(-len(everywhere) // 2)
    figure.set_size_inches(9, 1.5 + 2.7 * upper + 3.6 * len(tried))
    grid = figure.add_gridspec(upper + len(tried), 2, height_ratios=[3] * upper + [4] * len(tried))
    panels: list[Axes] = []
    for number, place in enumerate(everywhere):
        room = grid[divmod(number, 2)]
        panels.append(figure.add_subplot(room, sharey=panels[0] if panels else None))
        _everywhere(panels[-1], _at(rows, *place), _called(*place))
    _legend(figure, panels, "outside upper center")
    below: list[Axes] = []
    for row, place in enumerate(tried, start=upper):
        below += _below(figure, grid[row, :], _at(rows, *place), _called(*place))
    _legend(figure, below, "outside lower center")


def _below(figure: Figure, room: SubplotSpec, rows: Sequence[Row], title: str) -> list[Axes]:
    """The levers, and beside them the sample that grows, where there is one."""
    growing, grid = of(rows, MANY), room.subgridspec(1, 3)
    panels = [figure.add_subplot(grid[: 2 if growing else 3])]
    _levers(panels[0], rows, title)
    if growing:
        panels.append(figure.add_subplot(grid[2]))
        _sample(panels[1], growing, rows)
    return panels


def _at(rows: Sequence[Row], level: str, inside: str) -> list[Row]:
    """The rows of a garden and parent, without trials that did not come so far."""
    here = [row for row in rows if (row["level"], row.get("inside", inside)) == (level, inside)]
    return [row for row in here if row.get("there", True)]


def _called(level: str, inside: str) -> str:
    return f"{level}, parent {inside} inside"


def _legend(figure: Figure, panels: Sequence[Axes], where: Outside) -> None:
    """One for several panels, each name once."""
    known: dict[str, Any] = {}
    for axes in panels:
        handles, names = axes.get_legend_handles_labels()
        known = dict(zip(names, handles, strict=True)) | known
    figure.legend(known.values(), known.keys(), loc=where, ncols=3, fontsize=8)


# The panels


def _everywhere(axes: Axes, rows: Sequence[Row], title: str) -> None:
    _parent(axes, rows)
    _gradients(axes, of(rows, "policy gradients"))
    for name, look in CURVES.items():
        _curve(axes, name, of(rows, name), look)
    _finish(axes, title)


def _levers(axes: Axes, rows: Sequence[Row], title: str) -> None:
    """All lives whose stages are alike, beside each other; and how far the look-ahead is."""
    names = [name for name in dict.fromkeys(row["of"] for row in rows if "queries" in row) if name != MANY]
    _parent(axes, rows)
    _curve(axes, "look-ahead", of(rows, "look-ahead"), AHEAD)
    for number, name in enumerate(names):
        colour, mark = LEVERS[number % len(LEVERS)]
        look = CURVES.get(name, {"color": colour, "marker": mark, "linewidth": 1.0})
        _curve(axes, name, of(rows, name), look, ASIDE * (number - (len(names) - 1) / 2))
    _finish(axes, f"levers: {title}")


def _sample(axes: Axes, rows: Sequence[Row], lines: Sequence[Row]) -> None:
    """T = 1 as its sample grows; the axis of queries is logarithmic."""
    first = [row for row in rows if row["stage"] == 1]
    groups = {queries: _values(first, queries) for queries in sorted({row["queries"] for row in first})}
    _parent(axes, lines)
    for row in of(lines, "look-ahead"):
        if row["stage"] == 1:
            axes.axhline(row["waterings"], color=AHEAD["color"], label="look-ahead")
    _bars(axes, MANY, groups, {"color": "#332288", "marker": "s"})
    axes.set_xscale("log")
    axes.set_xticks(list(groups), [str(queries) for queries in groups], fontsize=7)
    axes.minorticks_off()
    axes.set_xlabel("queries at T = 1")
    axes.set_title("a growing sample", fontsize=10)


def _finish(axes: Axes, title: str) -> None:
    low, high = axes.get_xlim()
    axes.set_xticks([stage for stage in range(1, 20) if low <= stage <= high])
    axes.set_xlabel("clip length T")
    axes.set_ylabel("waterings in 10 steps")
    axes.set_title(title, fontsize=10)


# What stands in them


def _parent(axes: Axes, rows: Sequence[Row]) -> None:
    for row in of(rows, "parent"):
        axes.axhline(row["waterings"], color=PARENT, linestyle=":", label="parent")


def _gradients(axes: Axes, rows: Sequence[Row]) -> None:
    """Their mean at the last of their steps, and a band for the deviation over the trials."""
    last = max((row["steps"] for row in rows), default=0)
    values = [row["waterings"] for row in rows if row["steps"] == last]
    if values:
        mean, off = fmean(values), stdev(values) if len(values) > 1 else 0.0
        axes.axhline(mean, color=GRADIENTS, linestyle="--", label=f"policy gradients, {last} steps")
        axes.axhspan(mean - off, mean + off, color=GRADIENTS, alpha=0.15, linewidth=0)


def _curve(axes: Axes, name: str, rows: Sequence[Row], look: Look, aside: float = 0.0) -> None:
    """By T, at the last milestone of each stage."""
    groups = {}
    for stage in sorted({row["stage"] for row in rows}):
        mine = [row for row in rows if row["stage"] == stage]
        groups[stage + aside] = _values(mine, max(row.get("queries", 0) for row in mine))
    if name == LIVED and rows:
        name = f"{name}, {max(row['queries'] for row in rows if row['stage'] == 1)} queries a stage"
    _bars(axes, name, groups, look)


def _values(rows: Sequence[Row], queries: int) -> list[float]:
    return [row["waterings"] for row in rows if row.get("queries", 0) == queries]


def _bars(axes: Axes, name: str, groups: dict[Any, list[float]], look: Look) -> None:
    """Means over the trials, with bars of their deviation where there are several."""
    if groups:
        means = [fmean(values) for values in groups.values()]
        off = [stdev(values) if len(values) > 1 else 0.0 for values in groups.values()]
        axes.errorbar(
            list(groups), means, off if any(off) else None, capsize=2, markersize=5, label=name, **look
        )
