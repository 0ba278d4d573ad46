"""Snapshots of agents in training: policy and counts after given numbers of answered queries."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from parenting.agent.config import Config
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import Keys
from parenting.envs.struct import Struct
from parenting.experiments.training.batch import BatchTrainer
from parenting.experiments.training.counts import Counts, no_counts
from parenting.experiments.training.stop_rule import StopRule


class Passed(Struct):
    """All trials as they passed one milestone."""

    there: Bool[Tensor, "N"]  # it did come so far
    counts: Counts
    live: Float[Tensor, "N P"]  # pi_T


def train_with_snapshots(
    world: Gridworld,
    config: Config,
    keys: Keys,
    milestones: Sequence[int],
    max_ticks: int,
    weights: Tensor | None = None,
) -> list[Passed]:
    """Raise one agent for each of `keys` past every milestone, numbers of answered queries that grow.

    Trials that are not at the last one by `max_ticks`, or that are stuck, are not `there`.
    """
    trainer = BatchTrainer(world, config, keys, StopRule("queries", milestones[-1]), weights=weights)
    passed = [_none(trainer) for _ in milestones[:-1]]
    for _ in range(max_ticks):
        trainer.tick()
        answered = trainer.counts.queries.sum(1)
        for place, number in enumerate(milestones[:-1]):
            passed[place] = _note(trainer, passed[place], answered >= number)
        if bool(trainer.counts.done.all()):
            break
    trainer.save(~trainer.counts.done)
    ended = trainer.result.maturity - 1
    last = trainer.policies[ended, torch.arange(len(ended))]
    return [*passed, Passed(there=trainer.result.finished, counts=trainer.result, live=last)]


def _none(trainer: BatchTrainer) -> Passed:
    live = torch.zeros_like(trainer.state.learner.params)
    counts = no_counts(len(live), trainer.config.max_clip_length)
    return Passed(there=torch.zeros(len(live), dtype=torch.bool), counts=counts, live=live)


def _note(trainer: BatchTrainer, passed: Passed, beyond: Bool[Tensor, "n"]) -> Passed:
    """Those that are beyond the milestone for the first time, as they are now."""
    fresh = (beyond & ~passed.there[trainer.trial]).nonzero().squeeze(1)
    if not len(fresh):
        return passed
    place = trainer.trial[fresh]
    now = Passed(
        there=torch.ones_like(beyond), counts=trainer.counts, live=trainer.state.learner.params
    ).pick(fresh)
    ours = now.tensors()
    return passed.map(lambda name, tensor, _axis: tensor.index_put((place,), ours[name]))
