"""Tasks of Figure 3: agents parented in the levels set aside, and trials in the ten others (Sec. 3.4)."""

from __future__ import annotations

import time
from collections.abc import Sequence

import torch
from jaxtyping import Bool
from torch import Tensor

from parenting.agent.config import Config
from parenting.agent.init import world_of
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import Keys, keys
from parenting.experiments.figure3.levels import PARENTING, SET_ASIDE, WORLD, config_of, levels_for
from parenting.experiments.figure3.transfer import Transferred, pack, transfer, transferred
from parenting.experiments.runner.store import Row
from parenting.experiments.training.batch import BatchTrainer, TrainResult
from parenting.experiments.training.stop_rule import StopRule
from parenting.weights.store import initial_weights

PRE_PARENTED_FROM = 1 << 40
"""Agents that are pre-parented are numbered from here, times N: no trial has so high a number."""
PACKED = "_learnt"
BATCH = 5
"""Agents that are pre-parented in a batch, at most."""


class PreParenting(BatchTrainer):
    """Keeps what each agent has learnt at its own end."""

    def __init__(
        self, world: Gridworld, config: Config, keys: Keys, until: StopRule, weights: Tensor | None = None
    ) -> None:
        super().__init__(world, config, keys, until, weights=weights)
        self.kept: dict[int, Transferred] = {}

    def save(self, which: Bool[Tensor, "N"]) -> None:
        """Beside the results, all that was learnt."""
        super().save(which)
        for place in which.nonzero():
            self.kept[int(self.trial[place])] = transferred(self.state).pick(place)


def pre_parent(
    worlds: int,
    recompare: bool,
    everything: bool,
    span: tuple[int, int],
    max_ticks: int,
    seed: int,
    given: Sequence[Row],
) -> list[Row]:
    """Parent pre-trained agents until each is optimal in all of the first `worlds` levels set aside.

    After `max_ticks` an agent is given up, and is kept as it is then.
    """
    began = time.thread_time()
    agents = torch.arange(*span)
    first = keys(seed, 1).pick(torch.zeros_like(agents))
    mine = first.replace(seed=first.seed + PRE_PARENTED_FROM * worlds + agents)
    config = config_of(True, recompare)
    world = world_of(WORLD, levels_for(SET_ASIDE, given)[:worlds], config)
    trainer = PreParenting(world, config, mine, StopRule("optimal"), initial_weights(world, config))
    rows = _rows(trainer.run(max_ticks))
    said = {"of": "pre-parented", "worlds": worlds, "recompare": recompare}
    seconds = round((time.thread_time() - began) / len(rows), 3)
    return [
        {**said, "agent": agent, **row, "seconds": seconds, PACKED: pack(trainer.kept[place], everything)}
        for place, (agent, row) in enumerate(zip(range(*span), rows, strict=True))
    ]


def parent_trials(
    curve: str,
    pretrain: bool,
    everything: bool,
    recompare: bool,
    span: tuple[int, int],
    max_ticks: int,
    seed: int,
    given: Sequence[Row],
) -> list[Row]:
    """Parent the trials of a span until each is optimal in all ten levels, through which it cycles.

    Where pre-parented agents are among the given rows, the trials start from them in rotation: with their
    policies, or with `everything` that they have learnt.
    """
    began = time.thread_time()
    trials = range(*span)
    mine = keys(seed, span[1]).pick(torch.arange(*span))
    config = config_of(pretrain, recompare)
    world = world_of(WORLD, levels_for(PARENTING, given), config)
    weights = initial_weights(world, config)
    trainer = BatchTrainer(world, config, mine, StopRule("optimal"), weights=weights)
    packed = [row[PACKED] for row in given if row["of"] == "pre-parented"]
    if packed:
        trainer.state = transfer(trainer.state, packed, torch.arange(*span) % len(packed), everything)
    rows = _rows(trainer.run(max_ticks))
    seconds = round((time.thread_time() - began) / len(rows), 3)  # one batch: each has its share
    said = {"of": "parented", "curve": curve, "recompare": recompare, "seconds": seconds}
    return [
        {**said, "trial": trial, "agent": trial % len(packed) if packed else None, **row}
        for trial, row in zip(trials, rows, strict=True)
    ]


def _rows(result: TrainResult) -> list[Row]:
    counts = result.counts
    names = ("guidance", "preference", "deaths", "ticks", "finished", "stuck")
    columns = {name: getattr(counts, name).tolist() for name in names}
    rows = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    return [{"queries": row["guidance"] + row["preference"], **row} for row in rows]
