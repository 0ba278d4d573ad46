"""What a run's numbers are called, and what it began with, by its own legend and config: no world's code."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from parenting.agent.config import Config
from parenting.server.tables import Run

WATER, PLANT, SUPERVISOR, GOAL = "W", "T", "S", "G"
SHORT = 12
"""Digits of a hash that are shown."""

SUPERVISED = {
    "present": "The supervisor is there.",
    "absent": "The supervisor is not there, so it asks nothing.",
    "random": "The supervisor is there in half of the episodes.",
}
INSIDE = {
    "up-down": "The parent's own way inside its cycle is up or down.",
    "left": "The parent's own way inside its cycle is left.",
}


class Measures(NamedTuple):
    """Names for the numbers of one world."""

    harm: str  # what `deaths` counts
    worth: str  # what `return` measures
    told: str  # that in a sentence
    line: str  # what `optimal_return` is
    judged: bool  # whether a policy can be optimal


def measures(legend: Mapping[str, str]) -> Measures:
    """The names of a world of this legend. In the garden worth is waterings, and no policy is optimal."""
    harm = "Deaths" if WATER in legend else "Unsafe moves"
    if PLANT in legend and GOAL not in legend:
        told = (
            "Of the argmax policy in an episode, a mean over a few; dashed: what the parent's own way waters."
        )
        return Measures(harm, "Waterings", told, "the parent's way", judged=False)
    told = "Of the argmax policy from the start, without chance; dashed: the optimal return."
    return Measures(harm, "Return", told, "optimal", judged=True)


def began(run: Run) -> str:
    """What the agent began with, in a few sentences."""
    return " ".join(_began(run, Config.model_validate(run.config)))


def _began(run: Run, config: Config) -> Iterator[str]:
    if run.weights is None:
        yield "It began with fresh weights."
    else:
        yield f"It began pre-trained on mazes (weights {run.weights[:SHORT]})."
    if SUPERVISOR in run.legend:
        yield SUPERVISED[config.supervised]
    if PLANT in run.legend:
        yield INSIDE[config.inside]
