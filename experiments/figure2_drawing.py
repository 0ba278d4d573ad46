"""The drawing of Fig. 2: a panel for each garden and parent (Sec. 3.3)."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean, stdev
from typing import TYPE_CHECKING

from experiments.pieces import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LIVED = "conservative"
"""The life that is lived in all gardens."""
COLOURS = {"parent": "#999999", "policy gradients": "#cc79a7", "look-ahead": "#009e73", LIVED: "#0072b2"}


def draw(figure: Figure, rows: Sequence[Row]) -> None:
    """A panel for each garden and parent, and what it has of the lines."""
    panels = [(level, inside) for name, level, inside in kinds(rows) if name == LIVED]
    figure.set_size_inches(9, 7)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for (level, inside), one in zip(panels, axes.flat, strict=True):
        mine = [row for row in rows if row["level"] == level and row.get("inside", inside) == inside]
        _panel(one, mine)
        one.set_title(f"{level}, parent {inside} inside", fontsize=10)
    for one in axes[1]:
        one.set_xlabel("clip length T")
    for one in axes[:, 0]:
        one.set_ylabel("waterings in 10 steps")
    handles, labels = axes[1, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=8)


def _panel(axes: Axes, rows: Sequence[Row]) -> None:
    for name in dict.fromkeys(row["of"] for row in rows):
        mine = of(rows, name)
        colour = COLOURS.get(name)
        if name == "parent":
            axes.axhline(mine[0]["waterings"], color=colour, linestyle=":", label="parent")
        elif name == "policy gradients":
            last = [row["waterings"] for row in mine if row["steps"] == max(one["steps"] for one in mine)]
            axes.axhline(fmean(last), color=colour, linestyle="--", label="policy gradients, mean")
        else:
            _curve(axes, name, mine, colour)


def _curve(axes: Axes, name: str, rows: Sequence[Row], colour: str | None) -> None:
    """Means over the trials by T, at the last milestone of each stage, with the deviation over trials."""
    stages = sorted({row["stage"] for row in rows})
    ends = {stage: max(row.get("queries", 0) for row in rows if row["stage"] == stage) for stage in stages}
    each = [
        [
            row["waterings"]
            for row in rows
            if row["stage"] == stage and row.get("queries", 0) == ends[stage] and row.get("there", True)
        ]
        for stage in stages
    ]
    known = [(stage, values) for stage, values in zip(stages, each, strict=True) if values]
    bold = name in COLOURS
    axes.errorbar(
        [stage for stage, _ in known],
        [fmean(values) for _, values in known],
        yerr=[stdev(values) if len(values) > 1 else 0.0 for _, values in known],
        color=colour,
        marker="o",
        markersize=4 if bold else 3,
        linewidth=1.8 if bold else 0.9,
        capsize=3,
        label=f"{name}, 1000 queries a stage" if name == LIVED else name,
    )


def kinds(rows: Sequence[Row]) -> list[tuple[str, str, str]]:
    """Life, garden and parent, of all lives."""
    return list(dict.fromkeys((row["of"], row["level"], row["inside"]) for row in rows if "queries" in row))


def of(rows: Sequence[Row], name: str) -> list[Row]:
    """The rows of a life or a line."""
    return [row for row in rows if row["of"] == name]
