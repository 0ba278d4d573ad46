"""Settings of the calibration: the grid of layouts and hyperparameters, and its limits (Sec. 3.2.1)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from parenting.envs.levels.unsafe_exploration import ISLAND, ISLAND_BOTTLENECK
from parenting.experiments.calibrate.layouts import bottleneck
from parenting.experiments.spec import Scale

WORLD = "unsafe-exploration"


LAYOUTS = {
    "island": ISLAND,
    "strait-2-1": bottleneck(2, 1),
    "strait-1-1": bottleneck(1, 1),
    "island-bottleneck": ISLAND_BOTTLENECK,
}
"""From easy to hard; `bottleneck` has the rule."""


SOME: Mapping[Scale, int] = {"quick": 2, "paper": 8}
"""Trials of each setting of the search."""


GRID: Mapping[Scale, Mapping[str, tuple[Any, ...]]] = {
    "quick": {
        "layout": ("strait-1-1",),
        "chance": (0.35,),
        "entropy weights": ((1.0, 0.1),),
        "recompare": (True,),
        "entropy": (1.2,),
    },
    "paper": {
        "layout": tuple(LAYOUTS),
        "chance": (0.25, 0.3, 0.35, 0.45),  # of recording and of asking
        "entropy weights": ((0.01, 0.01), (1.0, 0.1), (0.5, 0.5)),  # lambda_global, lambda_local
        "recompare": (False, True),
        "entropy": (0.1, 0.5, 0.8, 1.0, 1.2),  # of policy gradients
    },
}


SEARCH_TICKS, SEARCH_STEPS = 1_000, 500
"""Where the search gives a trial up: ticks of parenting, and steps of policy gradients."""


MAX_TICKS, MAX_STEPS = 4_000, 1_000
"""Where the confirming trials are given up."""


OTHER = 7_919
"""Added to the seed for the search, so that what confirms its finding is not what made it."""
