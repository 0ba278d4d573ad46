"""Trials of a batch one by one, as plain data: how each ended, and its numbers by tick."""

from __future__ import annotations

from typing import Any, NamedTuple

from parenting.agent.init import world_of
from parenting.evaluation.argmax import evaluation
from parenting.experiments.training.chunks import TrainPlan
from parenting.experiments.training.history import metrics
from parenting.experiments.training.outcomes import Outcomes
from parenting.parents.scripted import ScriptedRule


class Trial(NamedTuple):
    """A trial that has ended."""

    number: int
    ticks: int
    maturity: int
    optimal: bool
    finished: bool
    stuck: bool
    answers: int
    metrics: dict[int, dict[str, Any]]  # by tick, by the names that stored runs have


def trials_of(plan: TrainPlan, outcomes: Outcomes) -> list[Trial]:
    """Return the trials of a batch whose history was kept.

    In the garden, where a return is a mean over episodes, some of the rows have one; the last one does.
    """
    counts = outcomes.counts
    world = world_of(plan.world, plan.level, plan.config)
    rule = ScriptedRule(world, plan.config.gamma, inside=plan.config.garden_parent)
    best = evaluation(world, rule.values, plan.config.gamma).best()
    found = []
    for number in range(len(counts.ticks)):
        rows = {
            tick: {**row, "optimal_return": best} for tick, row in metrics(outcomes.history[number]).items()
        }
        last, stage = int(counts.ticks[number]), int(counts.maturity[number])
        if outcomes.waterings.shape[1]:
            rows[last]["return"] = float(outcomes.waterings[number, stage - 1])
        optimal, finished, stuck = (
            bool(flags[number]) for flags in (counts.optimal, counts.finished, counts.stuck)
        )
        answers = int(counts.queries[number].sum())
        found.append(Trial(number, last, stage, optimal, finished, stuck, answers, rows))
    return found
