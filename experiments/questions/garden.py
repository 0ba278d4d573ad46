"""Trials in the garden (Sec. 3.2.2) for the page on questions: regret against the parent's own policy.

The garden has no goal, so that no policy counts as optimal and no trial is ever finished. Its agents live for
a fixed number of ticks. The regret of a policy is the waterings that the parent's own policy makes in an
episode less those of the argmax policy, in whole episodes from the start.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from jaxtyping import Float, Float64
from torch import Tensor

from parenting.agent.config import compose
from parenting.envs import registry
from parenting.envs.reward_hacking import RewardHacking
from parenting.envs.rng import keys
from parenting.evaluation.rollouts import deploy
from parenting.experiments.questions.settings import GARDEN
from parenting.experiments.runner.store import Row
from parenting.experiments.training.batch import BatchTrainer
from parenting.experiments.training.gardens import WORLD, garden
from parenting.experiments.training.stop_rule import StopRule
from parenting.parents.garden_values import GardenValues
from parenting.weights.store import initial_weights

EPISODES = 100
"""Of a deployment."""


def garden_trials(
    label: str, preset: str, ticks: int, marks: Sequence[int], span: tuple[int, int], seed: int
) -> list[Row]:
    """Raise the trials of a span for so many ticks: a row for each, and in others their mean curves.

    `marks` are numbers of answers, from 0 on, at which policies are deployed. The areas are those under the
    straight lines between them. A trial that does not come to a mark stands there as it ended.
    """
    config = compose(preset, registry.defaults(WORLD), {}, strict=True)
    world = garden(GARDEN, config.max_episode_steps)
    mine = keys(seed, span[1]).pick(torch.arange(*span))
    beyond = StopRule("ticks", ticks + 1)  # all stay in the batch
    trainer = BatchTrainer(world, config, mine, beyond, weights=initial_weights(world, config))
    policies, deaths = _live(trainer, ticks, marks)
    parent = float(GardenValues(world, config.gamma, config.garden_parent).waterings(world.time_limit)[0])
    regret = torch.stack([parent - _waterings(world, some) for some in policies])
    last = _waterings(world, trainer.policies[0])
    columns: dict[str, Any] = {
        name: getattr(trainer.result, name) for name in ("deaths", "guidance", "preference", "ticks", "stuck")
    }
    columns |= {"area_deaths": _area(deaths.double(), marks), "area_regret": _area(regret, marks)}
    columns |= {"waterings": last, "parent_waterings": torch.full_like(last, parent)}
    told = {name: column.tolist() for name, column in columns.items()}
    rows = [
        {"of": label, "trial": trial, **{name: column[place] for name, column in told.items()}}
        for place, trial in enumerate(range(*span))
    ]
    means = zip(marks, deaths.double().mean(1).tolist(), regret.mean(1).tolist(), strict=True)
    said = {"of": label, "trials": len(rows)}
    return [
        *rows,
        *({**said, "answers": mark, "deaths_then": died, "regret_then": lost} for mark, died, lost in means),
    ]


def _live(
    trainer: BatchTrainer, ticks: int, marks: Sequence[int]
) -> tuple[Float[Tensor, "K N P"], Float64[Tensor, "K N"]]:
    """The policies and the deaths at each mark, which are those of the tick before the next answer."""
    trials = len(trainer.trial)
    policies = trainer.state.learner.params.expand(len(marks), trials, -1).clone()
    deaths = torch.zeros(len(marks), trials, dtype=torch.int64)
    bounds = torch.tensor(marks)[:, None]
    for _ in range(ticks):
        trainer.tick()
        here = trainer.trial
        behind = trainer.counts.queries.sum(1) <= bounds  # these marks are not passed yet
        mark, place = behind.nonzero(as_tuple=True)
        policies[mark, here[place]] = trainer.state.learner.params[place]
        deaths[mark, here[place]] = trainer.counts.deaths[place]
    trainer.save(~trainer.counts.done)
    return policies, deaths


def _waterings(world: RewardHacking, policies: Float[Tensor, "N P"]) -> Float64[Tensor, "N"]:
    """The mean waterings of an episode, the same episodes for all policies."""
    return deploy(world, policies, EPISODES).waterings.mean(1)


def _area(values: Float64[Tensor, "K N"], marks: Sequence[int]) -> Float64[Tensor, "N"]:
    return torch.trapezoid(values, torch.tensor(marks, dtype=torch.float64), dim=0)
