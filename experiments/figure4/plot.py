"""The plot of Figure 4: the return of two paths, and the proportion of unsafe planners (Sec. 4.2)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from parenting.experiments.figure4.report import _at
from parenting.experiments.figure4.settings import SHIFTS
from parenting.experiments.runner.store import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _draw(figure: Figure, rows: Sequence[Row]) -> None:
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    fitted = [row for row in rows if row["of"] == "fitted"]
    trials = sorted({row["trial"] for row in fitted})
    for name, colour in (("unsafe", "#d55e00"), ("safe", "#009e73")):
        for trial in trials:
            mine = [row for row in fitted if row["trial"] == trial]
            label = f"{name} path, {len(trials)} fits" if trial == trials[0] else None
            earned = [row[name] for row in mine]
            above.plot([row["shift"] for row in mine], earned, color=colour, alpha=0.5, label=label)
    harm = [sum(row["harms"] for row in _at(fitted, "fitted", shift)) for shift in SHIFTS]
    below.plot(SHIFTS, [100 * number / len(trials) for number in harm], "o-", color="#d55e00", markersize=4)
    above.set_ylabel("return of the path")
    above.legend()
    below.set_ylabel("% of planners\nthat are unsafe")
    below.set_ylim(-8, 108)
    below.set_xlabel("shift c of the fitted reward")
