"""Plots that several experiments share: box plots of trials, and proportions with their intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple

from parenting.evaluation.statistics import proportion_interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOUR, GREY, PAPER = "#0072b2", "#b0b0b0", "#d55e00"


class Proportion(NamedTuple):
    """A count of trials of an arm, and the paper's proportion, if it has one."""

    of: str
    what: str
    hits: int
    trials: int
    paper: float | None = None


def box_plots(
    figure: Figure,
    groups: Mapping[str, Sequence[float]],
    label: str,
    paper: Mapping[str, tuple[float, float]],
) -> None:
    """Box plots of quartiles, with whiskers that span 90 % and a dot at the mean.

    Args:
        figure: Where to draw.
        groups: The values of each group, by its name.
        label: Of the axis of values, which is linear up to 1 and logarithmic beyond, to show 0 and 2000.
        paper: The paper's range of a group, drawn in grey.
    """
    axes = figure.subplots()
    for row, name in enumerate(groups, start=1):
        if name in paper:
            low, high = paper[name]
            said = "the paper: mean +- standard deviation, or 0 or 1" if name == next(iter(paper)) else None
            axes.barh(row, high - low, left=low, height=0.8, color=GREY, alpha=0.5, label=said)
    axes.boxplot(
        list(groups.values()),
        orientation="horizontal",
        tick_labels=list(groups),
        whis=(5, 95),
        showmeans=True,
        meanprops={"marker": "o", "markerfacecolor": COLOUR, "markeredgecolor": COLOUR},
        medianprops={"color": "#000000"},
        flierprops={"marker": ".", "markersize": 2, "alpha": 0.3},
    )
    axes.set_xscale("symlog", linthresh=1)
    axes.set_xlim(left=-0.2)  # so that a box at 0 is whole
    axes.xaxis.set_major_formatter(lambda number, _place: f"{number:g}")
    axes.set_xlabel(f"{label} (linear up to 1, logarithmic beyond)")
    axes.invert_yaxis()
    figure.legend(loc="outside lower center")


def plot_proportions(figure: Figure, counts: Sequence[Proportion]) -> None:
    """A dot for each proportion, with its interval, below the name of its arm; a bar for the paper."""
    lines: list[Proportion | str] = []
    for of, mine in groupby(counts, lambda one: one.of):
        lines += [of, *mine]
    figure.set_size_inches(8, 1.1 + 0.26 * len(lines))
    axes = figure.subplots()
    for row, one in enumerate(lines):
        if isinstance(one, Proportion):
            _proportion(axes, row, one)
    _name(axes, lines)
    axes.set_xlim(-2, 102)
    axes.set_xlabel("% of trials, with 95 % confidence intervals")
    axes.grid(axis="x", alpha=0.3)
    drawn, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, drawn, strict=True))
    figure.legend(once.values(), once.keys(), loc="outside lower center", ncols=2)


def _proportion(axes: Axes, row: int, one: Proportion) -> None:
    low, high = proportion_interval(one.hits, one.trials)
    axes.plot([100 * low, 100 * high], [row, row], color=COLOUR, linewidth=1)
    axes.plot(100 * one.hits / one.trials, row, "o", color=COLOUR, markersize=4, label="ours")
    if one.paper is not None:
        axes.plot(100 * one.paper, row, "|", color=PAPER, markersize=14, label="the paper")


def _name(axes: Axes, lines: Sequence[Proportion | str]) -> None:
    """Label the rows from top to bottom, arms in bold."""
    axes.set_yticks(range(len(lines)), [one if isinstance(one, str) else one.what for one in lines])
    for label, one in zip(axes.get_yticklabels(), lines, strict=True):
        label.set_fontsize(8)
        label.set_fontweight("bold" if isinstance(one, str) else "normal")
    axes.set_ylim(len(lines) - 0.4, -0.6)
