"""Tasks of Sec. 4.1: mature agents on random levels and count the states where they are greedy for V_T."""

from __future__ import annotations

from parenting.agent import parenting
from parenting.agent.events import Mature
from parenting.envs.mdp import explore
from parenting.envs.rng import keys
from parenting.experiments.runner.store import Row
from parenting.experiments.value_iteration.converge import (
    CONFIG,
    STAGES,
    StartStates,
    among,
    chosen,
    converged,
    greedy,
    iterated,
    parents_policy,
    run_stage,
)
from parenting.experiments.value_iteration.levels import random_levels
from parenting.experiments.value_iteration.settings import LEVELS, WORLD_SIZES
from parenting.parents.scripted import ScriptedRule
from parenting.parents.value_iteration import of_policy
from parenting.parents.values import TabularValues


def mature_trials(kind: str, trial: int, seed: int) -> list[Row]:
    """Mature agents on random levels through all stages; a row for each level and stage."""
    one = next(each for each in WORLD_SIZES if each.world == kind)
    drawn = (
        seed * 10_007 + trial
    ) % 2**63  # as torch takes it; an odd factor lets no two seeds fall together
    world = random_levels(one.world, one.height, one.width, count=LEVELS, seed=drawn)
    model = explore(world)
    values = of_policy(model, one.gamma, parents_policy(model, drawn))
    v, starts = iterated(model, values), StartStates(model)
    judge = ScriptedRule(world, one.gamma, TabularValues(model, values))
    state = parenting.init(world, CONFIG, keys(drawn, LEVELS))
    rows: list[Row] = []
    for stage in range(1, STAGES + 1):
        best = greedy(model, one.gamma, v[stage - 1])[starts.states]
        before = among(best, chosen(world, state, starts))
        state = run_stage(world, judge, state, starts)
        after, done = among(best, chosen(world, state, starts)), converged(world, state, starts)
        for level in range(LEVELS):
            count = int(starts.count[level])
            rows.append(
                {
                    "of": kind,
                    "trial": trial,
                    "level": level,
                    "stage": stage,
                    "states": count,
                    "converged": bool(done[level]),
                    "greedy": int(after[level, :count].sum()),
                    "greedy_before": int(before[level, :count].sum()),
                }
            )
        state, _ = parenting.apply(world, CONFIG, state, Mature())
    return rows
