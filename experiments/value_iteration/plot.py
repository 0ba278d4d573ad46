"""The drawing of Sec. 4.1: the policies that are greedy for V_T, before and after each stage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from parenting.experiments.reporting.plots import COLOUR
from parenting.experiments.runner.store import Row
from parenting.experiments.value_iteration.report import _hits, lives

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(figure: Figure, stages: Sequence[tuple[str, int]], rows: Sequence[Row]) -> None:
    """For each world and stage, the share of lives whose policy is greedy: at the stage's start and end."""
    axes = figure.subplots()
    for place, (kind, stage) in enumerate(stages):
        taught, already, _left = lives(kind, stage, rows)
        count = len(taught) + len(already)
        if not count:
            continue
        before, after = 100 * len(already) / count, 100 * (_hits(taught) + _hits(already)) / count
        axes.plot([before, after], [place, place], color=COLOUR, linewidth=1)
        axes.plot(before, place, "o", color=COLOUR, markerfacecolor="white")
        axes.plot(after, place, "o", color=COLOUR)
    axes.set_yticks(range(len(stages)), [f"{kind}, T = {stage}" for kind, stage in stages])
    axes.set_xlim(-2, 102)
    axes.set_xlabel("% of lives greedy for V_T (hollow: stage T begins, full: it ends)")
    axes.grid(axis="x", alpha=0.3)
    axes.invert_yaxis()
