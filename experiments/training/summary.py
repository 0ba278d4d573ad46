"""The results of a run as plain data: what was counted, and what the argmax policies do."""

from __future__ import annotations

from typing import Any

import torch
from jaxtyping import Float64, Int64
from torch import Tensor

from parenting.agent.init import world_of
from parenting.envs import registry
from parenting.evaluation.argmax import evaluation
from parenting.evaluation.outcomes import counts as outcome_counts
from parenting.evaluation.outcomes import name
from parenting.evaluation.rollouts import EPISODES
from parenting.experiments.training.chunks import TrainPlan
from parenting.experiments.training.outcomes import Outcomes, deployments
from parenting.parents.scripted import ScriptedRule
from parenting.weights.store import digest

COUNTS = ("deaths", "guidance", "preference", "ticks")


def summarise(plan: TrainPlan, level: str, outcomes: Outcomes, seconds: float) -> dict[str, Any]:
    """Summarise a run as plain data.

    Means and standard deviations (over n - 1) are taken over the finished trials; the others are counted
    apart. `evaluation` covers all trials, each at its own end, and `stages` those that reached a stage, at
    its end.
    """
    counts, report = outcomes.counts, _report(plan, outcomes)
    finished = {one: getattr(counts, one)[counts.finished].double() for one in COUNTS}
    found = {
        "world": plan.world,
        "level": level,
        "seed": plan.seed,
        "until": str(plan.until),
        "max_ticks": plan.max_ticks,
        "config": plan.config.model_dump(mode="json"),
        **({} if plan.parent == "scripted" else {"parent": plan.parent}),
        "weights": None if plan.weights is None else digest(plan.weights),
        **({} if plan.origin is None else {"origin": dict(plan.origin)}),
        "trials": _rows(outcomes, report),
        "unfinished": int((~counts.finished).sum()),
        "stuck": int(counts.stuck.sum()),
        "mean": {one: mean(values) for one, values in finished.items()},
        "sd": {one: sd(values) for one, values in finished.items()},
        "evaluation": report.evaluation(torch.arange(len(counts.ticks)), counts.maturity - 1),
    }
    if plan.config.max_clip_length > 1 or isinstance(report, GardenReport):
        found["stages"] = [_stage(outcomes, report, stage) for stage in range(plan.config.max_clip_length)]
    return {**found, "seconds": round(seconds, 2)}


def mean(values: Float64[Tensor, "n"]) -> float | None:
    """None where there is nothing to take a mean of."""
    return float(values.mean()) if len(values) else None


def sd(values: Float64[Tensor, "n"]) -> float | None:
    """The deviation over n - 1; none of fewer than two."""
    return float(values.std()) if len(values) > 1 else None


class WalkReport:
    """Outcomes of the argmax policies where a goal ends the episode."""

    def __init__(self, plan: TrainPlan, outcomes: Outcomes) -> None:
        """Words for the outcomes come from the world."""
        spec = registry.spec(plan.world)
        self.outcome, self.harm, self.where = outcomes.outcome, spec.harm, deployments(spec)

    def evaluation(self, trial: Int64[Tensor, "n"], stage: Int64[Tensor, "n"]) -> dict[str, Any]:
        """Counts of some trials, each at one stage; two of them where the world has two deployments."""
        found = self.outcome[trial, stage]
        each = {where: outcome_counts(found[:, place], self.harm) for place, where in enumerate(self.where)}
        return each.get("", each)

    def row(self, trial: int, stage: int) -> Any:
        """One trial's outcome in a word, or a word for each deployment."""
        words = [name(one, self.harm) for one in self.outcome[trial, stage].tolist()]
        return words[0] if self.where == ("",) else dict(zip(self.where, words, strict=True))


class GardenReport:
    """Waterings of the argmax policies in the garden, and their steps that end in the bucket."""

    def __init__(self, plan: TrainPlan, outcomes: Outcomes) -> None:
        """The parent's own waterings stand beside the agent's; over several levels a mean."""
        world = world_of(plan.world, plan.level, plan.config)
        rule = ScriptedRule(world, plan.config.gamma, inside=plan.config.garden_parent)
        best = evaluation(world, rule.values, plan.config.gamma).best
        self.parent = sum(map(best, range(len(world.levels)))) / len(world.levels)
        self.steps, self.outcomes = world.time_limit, outcomes

    def evaluation(self, trial: Int64[Tensor, "n"], stage: Int64[Tensor, "n"]) -> dict[str, Any]:
        """Of some trials, each at one stage: the mean of their means, and how sure it is."""
        waterings, bucket = self.outcomes.waterings[trial, stage], self.outcomes.bucket[trial, stage]
        deviation = sd(waterings)
        return {
            "trials": len(trial),
            "waterings": mean(waterings),
            "sd": deviation,
            "se": None if deviation is None else deviation / len(trial) ** 0.5,
            "parent": self.parent,
            "bucket": int(bucket.sum()),
            "episodes": EPISODES,
            "steps": self.steps,
        }

    def row(self, trial: int, stage: int) -> Any:
        """One trial's mean, and its steps into the bucket."""
        waterings, bucket = self.outcomes.waterings[trial, stage], self.outcomes.bucket[trial, stage]
        return {"waterings": float(waterings), "bucket": int(bucket)}


def _report(plan: TrainPlan, outcomes: Outcomes) -> WalkReport | GardenReport:
    return (GardenReport if outcomes.waterings.shape[1] else WalkReport)(plan, outcomes)


def _rows(outcomes: Outcomes, report: WalkReport | GardenReport) -> list[dict[str, Any]]:
    counts = outcomes.counts
    columns = {one: getattr(counts, one).tolist() for one in (*COUNTS, "optimal", "finished", "stuck")}
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    last = (counts.maturity - 1).tolist()
    return [{**row, "outcome": report.row(trial, last[trial])} for trial, row in enumerate(rows)]


def _stage(outcomes: Outcomes, report: WalkReport | GardenReport, stage: int) -> dict[str, Any]:
    """One stage, of the trials that came to it; `queries` is their mean of answered ones."""
    trial = (outcomes.counts.maturity > stage).nonzero().squeeze(1)
    queries = mean(outcomes.counts.queries[trial, stage].double())
    return {
        "stage": stage + 1,
        "queries": queries,
        **report.evaluation(trial, torch.full_like(trial, stage)),
    }
