"""Sec. 4.1: maturation is value iteration, begun at the parent's values. On random small worlds.

In a deterministic world, with a perfect parent and every stage converged, the policy of stage T is greedy for
V_T(s) = max_a [r + gamma V_{T-1}(s')], where V_0 = V_p is the value of the parent's own policy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from parenting.agent import parenting
from parenting.agent.events import Mature
from parenting.envs.mdp import explore
from parenting.envs.rng import keys
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results
from parenting.experiments.value_iteration.converge import (
    AGREED,
    CONFIG,
    CONVERGING,
    ROUNDS,
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
from parenting.experiments.value_iteration.report import draw, finding, words
from parenting.parents.scripted import ScriptedRule
from parenting.parents.values import TabularValues, of_policy

LEVELS = 6
"""Random levels of a trial, each with an agent of its own."""


class WorldSize(NamedTuple):
    """A deterministic world, the size of its random levels, and the parent's discount.

    It is below 1, since a random parent may never come to an end.
    """

    world: str
    height: int
    width: int
    gamma: float


WORLD_SIZES = (
    WorldSize("unsafe-exploration", 3, 3, 0.9),
    WorldSize("side-effects", 2, 3, 0.9),
    WorldSize("absent-supervisor", 3, 3, 0.9),
)


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


def _config(request: Request) -> Mapping[str, Any]:
    return {
        "kinds": [list(kind) for kind in WORLD_SIZES],
        "levels": LEVELS,
        "stages": STAGES,
        "agent": CONFIG.model_dump(mode="json"),
        "converging": {"gradient steps": CONVERGING, "rounds": ROUNDS, "logits apart": AGREED},
    }


def _tasks(request: Request) -> list[Task]:
    call = "parenting.experiments.value_iteration:mature_trials"
    return [
        Task(f"{kind.world}-{trial:06d}", call, {"kind": kind.world, "trial": trial, "seed": request.seed})
        for trial in range(request.trials)
        for kind in WORLD_SIZES
    ]


def _report(request: Request, rows: Sequence[Row]) -> Results:
    stages = [(kind.world, stage) for kind in WORLD_SIZES for stage in range(1, STAGES + 1)]
    found = [finding(kind, stage, rows) for kind, stage in stages]
    return Results(found, words(rows), {"stages": lambda figure: draw(figure, stages, rows)})


EXPERIMENT = Experiment(
    name="value-iteration",
    title="Sec. 4.1: maturation is value iteration",
    section="4.1",
    claim="With every stage converged, pi_T is greedy for V_T: value iteration begun at V_p.",
    trials={"quick": 1, "paper": 10},
    config=_config,
    tasks=_tasks,
    report=_report,
)
