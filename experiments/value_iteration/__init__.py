"""Sec. 4.1: maturation is value iteration, begun at the parent's values. On random small worlds.

In a deterministic world, with a perfect parent and every stage converged, the policy of stage T is greedy for
V_T(s) = max_a [r + gamma V_{T-1}(s')], where V_0 = V_p is the value of the parent's own policy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results
from parenting.experiments.value_iteration.converge import AGREED, CONFIG, CONVERGING, ROUNDS, STAGES
from parenting.experiments.value_iteration.plot import draw
from parenting.experiments.value_iteration.report import findings, words
from parenting.experiments.value_iteration.settings import LEVELS, WORLD_SIZES


def _config(request: Request) -> Mapping[str, Any]:
    return {
        "kinds": [list(kind) for kind in WORLD_SIZES],
        "levels": LEVELS,
        "stages": STAGES,
        "agent": CONFIG.model_dump(mode="json"),
        "converging": {"gradient steps": CONVERGING, "rounds": ROUNDS, "logits apart": AGREED},
    }


def _tasks(request: Request) -> list[Task]:
    call = "parenting.experiments.value_iteration.tasks:mature_trials"
    return [
        Task(f"{kind.world}-{trial:06d}", call, {"kind": kind.world, "trial": trial, "seed": request.seed})
        for trial in range(request.trials)
        for kind in WORLD_SIZES
    ]


def _report(request: Request, rows: Sequence[Row]) -> Results:
    stages = [(kind.world, stage) for kind in WORLD_SIZES for stage in range(1, STAGES + 1)]
    found = findings([kind.world for kind in WORLD_SIZES], rows)
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
