"""Name a run's numbers and describe its start by its own legend and config, without the world's code."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from parenting._plural import counted
from parenting.agent.config import Config
from parenting.server.origins import ROLLED_BACK
from parenting.server.pages.numbers import number
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
    "up-down": "Inside its cycle the parent's own policy goes up or down.",
    "left": "Inside its cycle the parent's own policy goes left.",
}


class MetricLabels(NamedTuple):
    """Names for the numbers of one world."""

    harm: str  # what `deaths` counts
    worth: str  # what `return` measures
    description: str  # that in a sentence
    reference: str  # what `optimal_return` is
    has_optimum: bool  # whether a policy can be optimal


def metric_labels(legend: Mapping[str, str]) -> MetricLabels:
    """The names of a world of this legend. In the garden worth is waterings, and no policy is optimal."""
    harm = "Deaths" if WATER in legend else "Unsafe moves"
    if PLANT in legend and GOAL not in legend:
        description = (
            "Of the argmax policy in an episode, a mean over a few; dashed: what the parent's own way waters."
        )
        return MetricLabels(harm, "Waterings", description, "the parent's way", has_optimum=False)
    description = "Of the argmax policy from the start, without chance; dashed: the optimal return."
    return MetricLabels(harm, "Return", description, "optimal return", has_optimum=True)


def describe_start(run: Run) -> str:
    """Describe in a few sentences how the agent began."""
    return " ".join(_start_sentences(run, Config.model_validate(run.config)))


def _start_sentences(run: Run, config: Config) -> Iterator[str]:
    earlier = run.origin or {}
    if "policy" in earlier:
        yield f"It began with the policy {_file(earlier['policy'])}."
    elif run.weights is None:
        yield "It began with fresh weights."
    else:
        yield f"It began pre-trained on mazes (weights {run.weights[:SHORT]})."
    if "answers" in earlier:
        answers = earlier["answers"]
        yield f"Its X began with {counted(answers['answers'], 'answer')} of {_file(answers)}."
    if ROLLED_BACK in earlier:
        source = earlier[ROLLED_BACK]
        tick, other = number(source["tick"]), f"{source['number']} ({source['run']})"
        yield f"Up to tick {tick} its record is that of run {other}."
    if SUPERVISOR in run.legend:
        yield SUPERVISED[config.supervised]
    if PLANT in run.legend:
        yield INSIDE[config.garden_parent]


def _file(part: Mapping[str, Any]) -> str:
    """Name a file that a run began with, its hash, and the run that it is of."""
    source = "" if part.get("run") is None else f", of run {part['run']}"
    return f"{part['file']} ({part['sha256'][:SHORT]}{source})"
