"""Drawings that several experiments share: how trials spread, and shares with their intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from experiments.findings import share_interval

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOUR = "#0072b2"


def spreads(figure: Figure, groups: Mapping[str, Sequence[float]], label: str) -> None:
    """A box for each group from its first quarter to its third, whiskers over 90 %, a point at the mean.

    The axis is linear up to 1 and logarithmic beyond, so that 0 and 2000 both have a place.
    """
    axes = figure.subplots()
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
    axes.set_xlim(left=0)
    axes.set_xlabel(label)
    axes.invert_yaxis()


def shares(figure: Figure, counts: Sequence[tuple[str, int, int]]) -> None:
    """A point for each count (what, hits, trials) with its 95 % interval, as a share of the trials."""
    figure.set_size_inches(9, 0.8 + 0.34 * len(counts))
    axes = figure.subplots()
    for row, (_what, hits, trials) in enumerate(counts):
        low, high = share_interval(hits, trials)
        axes.plot([100 * low, 100 * high], [row, row], color=COLOUR, linewidth=1)
        axes.plot(100 * hits / trials, row, "o", color=COLOUR, markersize=4)
    axes.set_yticks(range(len(counts)), [what for what, _hits, _trials in counts], fontsize=8)
    axes.set_xlim(-2, 102)
    axes.set_xlabel("% of the trials, with 95 % intervals")
    axes.grid(axis="x", alpha=0.3)
    axes.invert_yaxis()
