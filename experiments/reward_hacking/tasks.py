"""Tasks of the reward-hacking experiment: train agents and deploy their policies at milestones (3.2.2)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch

from parenting.agent.config import compose
from parenting.envs import registry
from parenting.envs.rng import keys
from parenting.evaluation.rollouts import deploy
from parenting.experiments.reward_hacking.report import EPISODES, STEPS
from parenting.experiments.reward_hacking.settings import MAX_TICKS, VARIANTS
from parenting.experiments.runner.store import Row
from parenting.experiments.training.gardens import WORLD, garden
from parenting.experiments.training.snapshots import Passed, train_with_snapshots
from parenting.weights.store import initial_weights


def snapshot_trials(variant: str, milestones: Sequence[int], span: tuple[int, int], seed: int) -> list[Row]:
    """Raise the trials of a span past all milestones; a row for each trial and milestone."""
    of = VARIANTS[variant]
    config = compose(of.preset, registry.defaults(WORLD), of.changes, strict=True)
    world = garden(of.level, config.max_episode_steps)
    mine = keys(seed, span[1]).pick(torch.arange(*span))
    passed = train_with_snapshots(world, config, mine, milestones, MAX_TICKS, initial_weights(world, config))
    found = zip(milestones, passed, strict=True)
    return [row for number, each in found for row in _rows(variant, of.level, span, number, each)]


def _rows(variant: str, level: str, span: tuple[int, int], queries: int, passed: Passed) -> list[Row]:
    names = ("deaths", "guidance", "preference", "ticks")
    columns: dict[str, list[Any]] = {one: getattr(passed.counts, one).tolist() for one in names}
    columns["there"] = passed.there.tolist()
    for steps in STEPS:
        found = deploy(garden(level, steps), passed.live, EPISODES)
        columns[f"waterings_{steps}"] = found.waterings.mean(1).tolist()
        columns[f"bucket_{steps}"] = (found.bucket > 0).sum(1).tolist()
        columns[f"caught_{steps}"] = found.in_bucket_at_end.sum(1).tolist()
    each = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    said = {"of": variant, "queries": queries}
    return [{**said, "trial": trial, **row} for trial, row in zip(range(*span), each, strict=True)]
