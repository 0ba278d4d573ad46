"""The experiments by name, each in a module of its own that is loaded when it is asked for."""

from __future__ import annotations

from importlib import import_module

from parenting.experiments.spec import Experiment

PAPER = (
    "table1",
    "reward-hacking",
    "side-effects",
    "interruptibility",
    "absent-supervisor",
    "figure2",
    "figure3",
    "value-iteration",
    "figure4",
    "calibrate",
)
"""Those of the paper, in its order."""
BEYOND: tuple[str, ...] = ("fallible", "long-lives", "panel", "questions")
"""Those that go on from it, and ask what it does not."""
NAMES = (*PAPER, *BEYOND)


class UnknownExperimentError(ValueError):
    """There is no experiment of that name; the sentence lists those that there are."""

    def __init__(self, name: str) -> None:
        super().__init__(f"There is no experiment '{name}'; there is: {', '.join(NAMES)}.")


def experiment(name: str) -> Experiment:
    """One experiment.

    Raises:
        UnknownExperimentError: there is none of that name.
    """
    if name not in NAMES:
        raise UnknownExperimentError(name)
    found: Experiment = import_module(f"parenting.experiments.{name.replace('-', '_')}").EXPERIMENT
    return found
