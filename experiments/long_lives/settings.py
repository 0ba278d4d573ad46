"""Settings of the experiment on long lives: stages, ticks and windows."""

from __future__ import annotations

from parenting.experiments.spec import Scale

WORLD, LEVEL, PRESET = "unsafe-exploration", "island", "frugal"
STAGES = {f"frugal, T = {last}": last for last in (1, 2, 3)}
"""The last stage of each life, by the name of its rows."""
FEW = 5
"""Agents at most with a last stage beyond T = 1."""
TICKS: dict[Scale, int] = {"quick": 40, "paper": 10_000}
"""Ticks of the last stage."""
WINDOW: dict[Scale, int] = {"quick": 20, "paper": 1000}
"""Ticks of a window."""
STAGE_TICKS: dict[Scale, int] = {"quick": 20, "paper": 200}
"""Ticks of each stage before the last, of which nothing is kept."""
TOGETHER = 25
"""Trials of a task at most: a part of an hour of a processor, which a run that is stopped loses."""


def agents_of(last: int, asked: int) -> int:
    """Return how many agents live with this last stage, where so many are asked."""
    return asked if last == 1 else min(asked, FEW)
