"""The plot of Sec. 4.1: the policies that are greedy for V_T, before and after each stage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from parenting.experiments.reporting.plots import COLOUR
from parenting.experiments.runner.store import Row
from parenting.experiments.value_iteration.report import agents, greedy_at_end

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(figure: Figure, stages: Sequence[tuple[str, int]], rows: Sequence[Row]) -> None:
    """The proportion of greedy policies for each world and stage, before the stage and after it."""
    axes = figure.subplots()
    for place, (kind, stage) in enumerate(stages):
        trained, already, _excluded = agents([kind], stage, rows)
        count = len(trained) + len(already)
        if not count:
            continue
        before, after = (
            100 * len(already) / count,
            100 * (greedy_at_end(trained) + greedy_at_end(already)) / count,
        )
        axes.plot([before, after], [place, place], color=COLOUR, linewidth=1)
        axes.plot(before, place, "o", color=COLOUR, markerfacecolor="white")
        axes.plot(after, place, "o", color=COLOUR)
    axes.set_yticks(range(len(stages)), [f"{kind}, T = {stage}" for kind, stage in stages])
    axes.set_xlim(-2, 102)
    axes.set_xlabel("% of agents greedy for V_T (hollow: before stage T, full: after it)")
    axes.grid(axis="x", alpha=0.3)
    axes.invert_yaxis()
