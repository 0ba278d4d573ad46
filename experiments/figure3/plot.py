"""The plot of Fig. 3: a histogram for each curve, without and with repeated queries (Sec. 3.4)."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from statistics import median
from typing import TYPE_CHECKING

from parenting.experiments.figure3.report import shown, trials_of
from parenting.experiments.runner.store import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {False: "#0072b2", True: "#e69f00"}
BINS = 40


def draw(figure: Figure, names: Sequence[str], rows: Sequence[Row]) -> None:
    """A row for each curve on the same axes; titles count the unfinished trials, which no bar includes."""
    figure.set_size_inches(9, 1.5 * len(names) + 1)
    panels = figure.subplots(len(names), 2, sharex=True, sharey=True, squeeze=False)
    most = max((row["queries"] for row in rows if row["of"] == "parented" and row["finished"]), default=1)
    edges = [most * place / BINS for place in range(BINS + 1)]
    for name, line in zip(names, panels, strict=True):
        for repeated, axes in zip((False, True), line, strict=True):
            _histogram(axes, name, trials_of(name, repeated, rows), edges, COLOURS[repeated])
    for repeated, axes in zip((False, True), panels[0], strict=True):
        way = "repeated queries" if repeated else "no repeated queries"
        axes.set_title(f"{way}\n{axes.get_title()}", fontsize=9)
    figure.supxlabel("queries until optimal in all parenting levels", fontsize=10)
    figure.supylabel("proportion of trials", fontsize=10)


def _histogram(axes: Axes, name: str, trials: Sequence[Row], edges: Sequence[float], colour: str) -> None:
    if not trials:
        axes.set_axis_off()
        return
    done = [row["queries"] for row in trials if row["finished"]]
    axes.hist(done, edges, weights=[1 / len(trials)] * len(done), color=colour)
    middle = median([row["queries"] if row["finished"] else inf for row in trials])
    if middle < inf:
        axes.axvline(middle, color="black", linewidth=1)
    left = len(trials) - len(done)
    said = f"median {middle:g}" if middle < inf else "median not reached"
    axes.set_title(
        f"{shown(name)}: {said}{f', {left} of {len(trials)} unfinished' if left else ''}", fontsize=9
    )
