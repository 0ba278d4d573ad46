"""Tasks that raise agents by the scripted parent or by reward: a row for each trial, as plain data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import torch

from parenting.agent.config import Config, compose
from parenting.agent.init import world_of
from parenting.agent.pretraining import ENTROPY
from parenting.envs import registry
from parenting.envs.rng import keys
from parenting.evaluation.outcomes import name
from parenting.experiments.baselines.reinforce_tabular import train_reinforce
from parenting.experiments.runner.store import Row
from parenting.experiments.training.chunks import TrainPlan, train_chunk
from parenting.experiments.training.outcomes import Outcomes, deployments
from parenting.experiments.training.stop_rule import StopRule
from parenting.weights.store import Wanted, find

Goal = Literal["optimal", "queries", "ticks"]
COUNTS = ("deaths", "guidance", "preference", "ticks")
NOTED = ("optimal_at", "optimal_deaths", "optimal_queries")
"""Columns of trials whose first optimal policy is noted."""


def parent_trials(
    label: str,
    world: str,
    level: str,
    preset: str,
    changes: Mapping[str, Any],
    until: tuple[Goal, int],
    max_ticks: int,
    span: tuple[int, int],
    seed: int,
    note_optimal: bool = False,
    parent: str = "scripted",
) -> list[Row]:
    """Raise the trials of a span by a parent of `parents.grammar`; `label` names what they are of."""
    config = compose(preset, registry.defaults(world), changes, strict=True)
    weights = _weights(world, level, config)
    plan = TrainPlan(
        world, level, config, seed, span[1], StopRule(*until), max_ticks, weights, parent, note_optimal
    )
    columns = (*COUNTS, *(NOTED if note_optimal else ()))
    return _rows(label, range(*span), train_chunk(plan, range(*span)), world, columns)


def reinforce_trials(
    label: str,
    world: str,
    level: str,
    changes: Mapping[str, Any],
    max_steps: int,
    span: tuple[int, int],
    seed: int,
    entropy: float = ENTROPY,
) -> list[Row]:
    """Raise the trials of a span by policy gradients on the reward itself."""
    config = compose("direct", registry.defaults(world), changes, strict=True)
    mine = keys(seed, span[1]).pick(torch.arange(*span))
    found = train_reinforce(world_of(world, level, config), config, mine, max_steps, entropy=entropy)
    columns = {one: getattr(found, one).tolist() for one in ("deaths", "ticks", "steps", "optimal")}
    rows = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    nothing = {"guidance": 0, "preference": 0, "stuck": False}
    return [
        {"of": label, "trial": trial, **row, **nothing, "finished": row["optimal"]}
        for trial, row in zip(range(*span), rows, strict=True)
    ]


def _weights(world: str, level: str, config: Config) -> bytes | None:
    """The shipped weights, where these trials begin pre-trained (Sec. 3.1.4)."""
    if not config.pretrain:
        return None
    drawn = registry.level(world, level)
    return find(Wanted(registry.spec(world), drawn.height, drawn.width)).read_bytes()


def _rows(label: str, span: range, outcomes: Outcomes, world: str, counted: Sequence[str]) -> list[Row]:
    counts, spec = outcomes.counts, registry.spec(world)
    columns = {one: getattr(counts, one).tolist() for one in (*counted, "optimal", "finished", "stuck")}
    rows = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    last = (counts.maturity - 1).tolist()
    found = [{"of": label, "trial": trial, **row} for trial, row in zip(span, rows, strict=True)]
    for place, row in enumerate(found):
        for column, where in enumerate(deployments(spec) if outcomes.outcome.shape[2] else ()):
            outcome = int(outcomes.outcome[place, last[place], column])
            row["_".join(filter(None, ("outcome", where)))] = name(outcome, spec.harm)
    return found
