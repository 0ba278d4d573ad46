"""The plot of the panel experiment: right answers and deaths of each rule, panel by panel."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean
from typing import TYPE_CHECKING

from parenting.evaluation.statistics import mean_interval
from parenting.experiments.panel.report import of, right
from parenting.experiments.panel.settings import PANELS, RULES
from parenting.experiments.runner.store import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = dict(zip(RULES, ("#b0b0b0", "#d55e00", "#cc79a7", "#0072b2", "#009e73"), strict=True))


def draw(figure: Figure, rows: Sequence[Row]) -> None:
    """A dot with its interval for each rule of each panel."""
    figure.set_size_inches(8, 5)
    answers, deaths = figure.subplots(1, 2, sharey=True)
    for place, panel in enumerate(PANELS):
        for shift, rule in enumerate(RULES):
            mine, height = of(rows, panel.name, rule), place + 0.14 * (shift - 2)
            label = rule if place == 0 else None
            for axes, values in ((answers, right(mine)), (deaths, [row["deaths"] for row in mine])):
                interval = mean_interval(values)
                if interval:
                    axes.plot(
                        [interval.low, interval.high], [height, height], color=COLOURS[rule], linewidth=1
                    )
                axes.plot(fmean(values), height, "o", color=COLOURS[rule], markersize=4, label=label)
                label = None
    answers.set_yticks(range(len(PANELS)), [panel.name for panel in PANELS])
    answers.invert_yaxis()
    answers.set_xlabel("right answers in %")
    deaths.set_xscale("symlog", linthresh=1)
    deaths.set_xlim(left=-0.1)
    deaths.xaxis.set_major_formatter(lambda number, _place: f"{number:g}")
    deaths.set_xlabel("deaths (linear up to 1)")
    for axes in (answers, deaths):
        axes.grid(axis="x", alpha=0.3)
    figure.legend(loc="outside lower center", ncols=len(RULES))
