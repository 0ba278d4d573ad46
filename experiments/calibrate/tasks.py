"""Tasks of the calibration: a few trials for each setting, and more for the nearest one (Sec. 3.2.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from parenting.agent.config import PRESETS
from parenting.experiments.calibrate.distance import DIRECT, TRADITIONAL, search
from parenting.experiments.calibrate.settings import (
    LAYOUTS,
    MAX_STEPS,
    MAX_TICKS,
    OTHER,
    SEARCH_STEPS,
    SEARCH_TICKS,
    WORLD,
)
from parenting.experiments.runner.store import Row
from parenting.experiments.training.tasks import parent_trials, reinforce_trials


def try_direct(layout: str, hyperparameters: Mapping[str, Any], trials: int, seed: int) -> list[Row]:
    """Direct policy learning with one setting."""
    text, span = LAYOUTS[layout], (0, trials)
    rows = parent_trials(
        DIRECT, WORLD, text, "direct", hyperparameters, ("optimal", 0), SEARCH_TICKS, span, seed + OTHER
    )
    return [{**row, "layout": layout, **hyperparameters} for row in rows]


def try_reward(layout: str, entropy: float, trials: int, seed: int) -> list[Row]:
    """Policy gradients with one weight of their entropy."""
    span = (0, trials)
    rows = reinforce_trials(
        TRADITIONAL, WORLD, LAYOUTS[layout], {}, SEARCH_STEPS, span, seed + OTHER, entropy
    )
    return [{**row, "layout": layout, "entropy": entropy} for row in rows]


def confirm_trials(algorithm: str, span: tuple[int, int], seed: int, given: Sequence[Row]) -> list[Row]:
    """Trials of one algorithm of Table 1 with what the search, whose rows are `given`, has found nearest."""
    best, *_ = search(given)
    text = LAYOUTS[best.layout]
    if algorithm == "traditional":
        return reinforce_trials(algorithm, WORLD, text, {}, MAX_STEPS, span, seed, best.entropy)
    hyperparameters = changes(algorithm, best.direct)
    return parent_trials(
        algorithm, WORLD, text, algorithm, hyperparameters, ("optimal", 0), MAX_TICKS, span, seed
    )


def changes(preset: str, direct: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a preset takes over from direct policy learning.

    Lax parenting takes all of it; conservative parenting keeps its own probabilities.
    """
    own = PRESETS[preset] if preset == "conservative" else {}
    return {name: value for name, value in direct.items() if name not in own}
