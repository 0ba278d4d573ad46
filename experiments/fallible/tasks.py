"""Tasks of the experiment on parents who err: raise agents, and note when each is first optimal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch

from parenting.agent.config import Config, compose
from parenting.agent.init import world_of
from parenting.agent.parent import BatchParent
from parenting.agent.query import QueryKind
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import keys
from parenting.experiments.fallible.thrice import BestOfThree
from parenting.experiments.runner.store import Row
from parenting.experiments.training.batch import MakeParent, train_agents
from parenting.experiments.training.counts import Counts
from parenting.experiments.training.stop_rule import StopRule
from parenting.experiments.training.tasks import COUNTS, NOTED
from parenting.parents.fallible import FallibleParent, FallibleRule
from parenting.parents.grammar import read_parent
from parenting.parents.scripted import ScriptedParent
from parenting.weights.store import initial_weights

COLUMNS = (*COUNTS, *NOTED, "optimal", "finished", "stuck")


def erring_trials(
    label: str,
    world: str,
    level: str,
    preset: str,
    changes: Mapping[str, Any],
    parent: str,
    thrice: bool,
    ticks: int,
    span: tuple[int, int],
    seed: int,
    until_optimal: bool = False,
) -> list[Row]:
    """Raise the trials of a span for so many ticks by a parent who errs, or is asked thrice each time.

    Each ends when its policy is first optimal, if that is asked for.
    """
    config = compose(preset, registry.defaults(world), changes, strict=True)
    lived, mine = world_of(world, level, config), keys(seed, span[1]).pick(torch.arange(*span))
    asked = list[BestOfThree]()
    counts = train_agents(
        lived,
        config,
        mine,
        StopRule("optimal") if until_optimal else StopRule("ticks", ticks),
        max_ticks=ticks,
        weights=initial_weights(lived, config),
        parent=_maker(lived, config, parent, asked if thrice else None),
        note_optimal=True,
    ).counts
    if thrice:
        counts = _counted(counts, asked[0])
    columns = {one: getattr(counts, one).tolist() for one in COLUMNS}
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    return [{"of": label, "trial": trial, **row} for trial, row in zip(range(*span), rows, strict=True)]


def _maker(world: Gridworld, config: Config, parent: str, asked: list[BestOfThree] | None) -> MakeParent:
    rule = FallibleRule(world, read_parent(parent), config.gamma, config.garden_parent)

    def make(scripted: ScriptedParent, _done: object) -> BatchParent:
        erring = FallibleParent(rule, scripted.query)
        if asked is None:
            return erring
        asked.append(BestOfThree(erring, len(scripted.query.kind)))
        return asked[0]

    return make


def _counted(counts: Counts, asked: BestOfThree) -> Counts:
    """The counts with all answers that were given, the repeats among them."""
    then = torch.stack(asked.after)[(counts.optimal_at - 1).clamp_min(0), torch.arange(len(counts.ticks))]
    return counts.replace(
        guidance=counts.guidance + asked.repeats[QueryKind.GUIDANCE],
        preference=counts.preference + asked.repeats[QueryKind.PREFERENCE],
        optimal_queries=counts.optimal_queries + torch.where(counts.optimal_at > 0, then, 0),
    )
