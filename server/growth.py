"""The growth of an agent as its parent is told of it: safe cells, milestones, what the last answer changed.

All of it is read off a life that goes on. Nothing of the agent is changed, and no random number is drawn.
"""

from __future__ import annotations

import time
from typing import Any

from parenting.agent.config import Config, too_large
from parenting.agent.parent import Parent
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld
from parenting.evaluation.argmax import Evaluation, TabularEvaluation
from parenting.evaluation.safe_cells import SafeCells
from parenting.server.counters import Counters
from parenting.server.lesson import Lesson, Overheard
from parenting.server.metrics_row import Row
from parenting.server.milestones import Milestones
from parenting.server.tables import Run

SHARE = 0.05
"""The share of time at most that looks at the cells take."""


class NotFiniteError(Exception):
    """The policy has learnt numbers that are none: no probability can be read off it any more."""


class Growth:
    """The growth of one agent in a worker."""

    def __init__(
        self, world: Gridworld, run: Run, evaluation: Evaluation, state: AgentState, tally: Counters
    ) -> None:
        """Begin after the last tick of `state`. A world without a goal has no safe cells."""
        self._config = run.config
        self.milestones = Milestones(world, run.milestones, int(state.keys.tick[0]), tally)
        self.lesson = Lesson(world)
        self._cells = SafeCells(evaluation) if isinstance(evaluation, TabularEvaluation) else None
        self._row: Row = {}
        self._looked: tuple[int, int] | None = None  # stage and gradient steps of the last look at the cells
        self._due = 0.0

    def overhear(self, parent: Parent) -> Parent:
        """Return a parent whose answers this hears, too."""
        return Overheard(parent, self.lesson)

    def see(self, state: AgentState, tally: Counters) -> None:
        """Look at the tick that has just passed.

        Raises:
            NotFiniteError: the policy is not finite after it; the sentence names the remedy.
        """
        if not is_finite(state):
            config = Config.model_validate(self._config)
            name = next(iter(too_large(config)), "learning_rate")
            raise NotFiniteError(
                f"The policy's weights are no longer finite at tick {int(state.keys.tick[0])}: "
                f"a smaller {name} than {getattr(config, name):g} is needed."
            )
        self.milestones.see(state, tally)

    def row(self, state: AgentState) -> Row:
        """Return the number of cells and of safe ones for a row of metrics, as last looked at."""
        now, policy = time.monotonic(), (int(state.maturity[0]), int(state.learner.steps[0]))
        if self._cells is None or policy == self._looked or now < self._due:
            return self._row
        self._looked = policy
        self._row = {
            "cells": len(self._cells.cells),
            "safe_cells": self._cells.count(state.learner.params),
        }
        took = time.monotonic() - now
        self._due = now + took / SHARE
        return self._row

    def news(self, state: AgentState) -> dict[str, Any]:
        """Return the `milestones` and the `lesson` for the run's row, as far as they are new."""
        found: dict[str, Any] = {}
        if self.milestones.new:
            found["milestones"], self.milestones.new = dict(self.milestones.reached), False
        if (lesson := self.lesson.news(state)) is not None:
            found["lesson"] = lesson
        return found


def is_finite(state: AgentState) -> bool:
    """Return whether the policy is finite in all that a tick shows of it: weights, loss, probabilities."""
    shown = [state.info.logits]
    if bool(state.info.trained.any()):
        shown += [state.learner.params, state.info.loss]
    return all(bool(numbers.isfinite().all()) for numbers in shown)
