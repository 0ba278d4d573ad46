"""Tasks of the experiment on questions: a row for each trial, as plain data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import torch

from parenting.agent import parenting
from parenting.agent.config import compose
from parenting.agent.events import Mature
from parenting.agent.init import network_of, world_of
from parenting.agent.pretraining_loop import Pretrainer
from parenting.envs import registry
from parenting.envs.levels.spec import Level
from parenting.envs.mdp import explore
from parenting.envs.random_islands import island_levels
from parenting.envs.rng import keys
from parenting.experiments.figure3.transfer import pack, transfer, transferred
from parenting.experiments.questions.bounds import certain, expected
from parenting.experiments.questions.settings import ANSWERS, ISLANDS, MARKS, STARTS, WINDOW, WORLD
from parenting.experiments.questions.tabular import ideal_trial, table
from parenting.experiments.questions.tracking import QuestionTrainer
from parenting.experiments.runner.store import Row
from parenting.experiments.training.batch import parent_of
from parenting.experiments.training.counts import Counts
from parenting.experiments.training.stop_rule import StopRule

COUNTS = ("deaths", "guidance", "preference", "ticks", "optimal", "finished", "stuck")
PACKED = "_policy"
ENDLESS = StopRule("ticks", 10**9)


class Life(NamedTuple):
    """The settings that the trials of a task share."""

    world: str
    level: str  # a built-in one, or a name of `ISLANDS`
    preset: str
    changes: Mapping[str, Any]
    parent: str = "scripted"  # by the grammar of `parents.grammar`


def question_trials(
    label: str,
    life: Sequence[Any],
    share: float | None,
    max_ticks: int,
    span: tuple[int, int],
    seed: int,
    given: Sequence[Row] = (),
) -> list[Row]:
    """Raise the trials of a span until optimal: a row for each, and their mean curves in rows of their own.

    Where agents are given, the trials begin with their policies in rotation.
    """
    trainer = _trainer(Life(*life), StopRule("optimal"), span, seed, ANSWERS, share)
    if given:
        packed, agent = [row[PACKED] for row in given], torch.arange(*span) % len(given)
        trainer.state = transfer(trainer.state, packed, agent, everything=False)
    rows = _rows(label, span, trainer.run(max_ticks).counts)
    curves = trainer.curves()
    areas = {"area_deaths": curves.deaths[:, :-1].sum(1), "area_regret": curves.regret[:, :-1].sum(1)}
    for name, area in areas.items():
        for row, value in zip(rows, area.tolist(), strict=True):
            row[name] = value
    means = [curves.deaths.mean(0).tolist(), curves.regret.mean(0).tolist()]
    said = {"of": label, "trials": len(rows)}
    points = [
        {**said, "answers": place, "deaths_then": means[0][place], "regret_then": means[1][place]}
        for place in MARKS
    ]
    return [*rows, *points]


def parented_policies(level: str, preset: str, ticks: int, agents: int, seed: int) -> list[Row]:
    """Raise agents on random islands, through which each cycles; a row for each, with its policy."""
    config = compose(preset, registry.defaults(WORLD), {}, strict=True)
    world = world_of(WORLD, island_levels(*STARTS[level]), config)
    mine = keys(seed + 1, agents)  # other streams than those of the trials
    trainer = QuestionTrainer(world, config, mine, ENDLESS, cycling=True)
    counts = trainer.live(ticks)
    return [
        {
            "of": f"pre-parented, {level}",
            "agent": agent,
            "deaths": int(counts.deaths[agent]),
            "guidance": int(counts.guidance[agent]),
            PACKED: pack(transferred(trainer.state).pick(torch.tensor([agent])), everything=False),
        }
        for agent in range(agents)
    ]


def maze_policy(level: str, preset: str, steps: int, seed: int) -> list[Row]:
    """Pre-train a policy on mazes of the level's size (Sec. 3.1.4); one row, with the policy."""
    config = compose(preset, registry.defaults(WORLD), {}, strict=True)
    world = world_of(WORLD, level, config)
    school = Pretrainer(network_of(world), world.spec.glyphs, seed)
    trained = school.init()
    for _ in range(steps):
        trained = school.update(trained)
    state = parenting.init(world, config, keys(seed, 1))
    state = state.replace(learner=state.learner.replace(params=trained.params))
    return [{"of": f"pre-trained, {level}", "agent": 0, PACKED: pack(transferred(state), everything=False)}]


def ideal_trials(label: str, world: str, level: str, span: tuple[int, int], seed: int) -> list[Row]:
    """Raise ideal tabular agents; the bounds of the level stand in each row."""
    config = compose("conservative", registry.defaults(world), {"pretrain": False}, strict=True)
    made = world_of(world, level, config)
    model = explore(made)
    known = table(made, model, config.gamma)
    bounds = {"least_mean": expected(model, 0), "certain": certain(model, 0)}
    found = [ideal_trial(known, seed, trial) for trial in range(*span)]
    return [
        {"of": label, "trial": trial, "guidance": answers, "finished": finished, **bounds}
        for trial, (answers, finished) in zip(range(*span), found, strict=True)
    ]


def long_trials(
    label: str,
    life: Sequence[Any],
    ticks: int,
    stage_ticks: int,
    span: tuple[int, int],
    seed: int,
    window: int = WINDOW,
) -> list[Row]:
    """Live on in the last stage: answers and deaths of each trial in windows of ticks from its beginning.

    The operator ends each earlier stage after `stage_ticks`.
    """
    trainer = _trainer(Life(*life), ENDLESS, span, seed)
    for _ in range(trainer.config.max_clip_length - 1):
        trainer.live(stage_ticks)
        trainer.state, _ = parenting.apply(trainer.world, trainer.config, trainer.state, Mature())
    length = min(ticks, window)
    windows = ticks // length
    marks = [trainer.counts, *(trainer.live(length) for _ in range(windows))]
    answered, died = (
        [(now - before).tolist() for before, now in pairwise(column)]
        for column in ([mark.queries.sum(1) for mark in marks], [mark.deaths for mark in marks])
    )
    return [
        {
            "of": label,
            "trial": trial,
            "window": number + 1,
            "answered": answered[number][place],
            "deaths": died[number][place],
            "ticks": length,
        }
        for place, trial in enumerate(range(*span))
        for number in range(windows)
    ]


def lasting_trials(
    label: str, life: Sequence[Any], ticks: int, span: tuple[int, int], seed: int
) -> list[Row]:
    """Live on after the policy was first optimal: how often it is lost, and what there is at the end."""
    trainer = _trainer(Life(*life), ENDLESS, span, seed)
    every = torch.ones(span[1] - span[0], dtype=torch.bool)
    ever, last = torch.zeros_like(every), torch.zeros_like(every)
    lost, away = torch.zeros_like(every, dtype=torch.int64), torch.zeros_like(every, dtype=torch.int64)
    for _ in range(ticks):
        trainer.tick()
        now = trainer.optimal_now()
        lost += last & ~now
        away += ever & ~now
        ever, last = ever | now, now
    columns = {"optimal": last, "ever": ever, "lost": lost, "away": away}
    counts = {name: getattr(trainer.counts, name) for name in ("deaths", "guidance", "preference", "ticks")}
    told = {name: column.tolist() for name, column in {**counts, **columns}.items()}
    return [
        {"of": label, "trial": trial, **{name: column[place] for name, column in told.items()}}
        for place, trial in enumerate(range(*span))
    ]


def _trainer(
    life: Life,
    until: StopRule,
    span: tuple[int, int],
    seed: int,
    answers: int = 0,
    share: float | None = None,
) -> QuestionTrainer:
    config = compose(life.preset, registry.defaults(life.world), life.changes, strict=True)
    made = world_of(life.world, _levels(life.level), config)
    mine = keys(seed, span[1]).pick(torch.arange(*span))
    parent = parent_of(life.parent, made, config)
    return QuestionTrainer(
        made, config, mine, until, first=span[0], answers=answers, share=share, parent=parent
    )


def _levels(level: str) -> str | tuple[Level, ...]:
    """A level by its name, or a set of random islands."""
    return island_levels(*ISLANDS[level]) if level in ISLANDS else level


def _rows(label: str, span: tuple[int, int], counts: Counts) -> list[Row]:
    columns = {one: getattr(counts, one).tolist() for one in COUNTS}
    rows = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    return [{"of": label, "trial": trial, **row} for trial, row in zip(range(*span), rows, strict=True)]
