"""The growth of an agent by answers, as its parent sees it: a line, a sentence, and the milestones."""

from __future__ import annotations

from typing import Any

from parenting.drawing.growth import GrowthView, growth_view
from parenting.drawing.sentences import mark, tr
from parenting.drawing.walk_view import percent
from parenting.server.db import Database
from parenting.server.reads.metrics import latest_metrics, sampled_metrics
from parenting.server.tables import Run

MILESTONES = {
    "goal": mark("It reached the goal for the first time."),
    "calm": mark("It made no unsafe move in 100 ticks."),
}
"""The sentence of each milestone (`server.milestones`)."""
POINTS = 60
WAYS = ("up", "down", "left", "right")
LEAST = 0.01
"""A probability that changed by less is not told."""


def growth_of(db: Database, run: Run) -> GrowthView | None:
    """Return the growth line of a run; None while it has no point.

    In worlds with a goal a point is the share of cells from which the agent's likeliest moves reach the goal
    safely. The garden has no goal: there it is the return, as a share of what its parent's own way earns.
    """
    rows = [row.values for row in reversed(sampled_metrics(db, run.id, POINTS))]
    last = latest_metrics(db, [run.id]).get(run.id)
    if last is not None and last.values not in rows:
        rows.append(last.values)
    goal = "G" in run.legend
    points = {_answers(row): share for row in rows if (share := _share(row, goal)) is not None}
    if not points:
        return None
    return growth_view(sorted(points.items()), rows[-1].get("cells") if goal else None)


def milestones_of(run: Run) -> dict[str, str]:
    """Return the sentences of the milestones that a run has reached, in the order of their ticks."""
    reached = sorted((run.milestones or {}).items(), key=lambda found: found[1])
    return {name: tr(MILESTONES[name]) for name, _ in reached if name in MILESTONES}


def lesson_of(run: Run) -> str | None:
    """Return what the last answer has changed, in a sentence; None before the first one."""
    if run.lesson is None:
        return None
    changed = [
        f"{tr(way)} {percent(before)} → {percent(after)}"
        for way, before, after in zip(WAYS, run.lesson["before"], run.lesson["after"], strict=True)
        if abs(after - before) >= LEAST
    ]
    if not changed:
        return tr("The last answer has hardly changed what it would do in the cell of the question.")
    return tr(
        "The last answer changed what it would do in the cell of the question: {changes}.",
        changes=", ".join(changed),
    )


def _answers(row: dict[str, Any]) -> int:
    """Return the number of answers that the agent had heard."""
    return int((row.get("guidance") or 0) + (row.get("preference") or 0))


def _share(row: dict[str, Any], goal: bool) -> float | None:
    """Return the share of a row; None where it was not measured, as in rows of older versions."""
    part, whole = ("safe_cells", "cells") if goal else ("return", "optimal_return")
    found, most = row.get(part), row.get(whole)
    if found is None or most is None or most <= 0:
        return None
    return float(min(1.0, max(0.0, found / most)))
