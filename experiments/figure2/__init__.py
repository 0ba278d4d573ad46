"""Figure 2: waterings as the agent matures, against its parent, policy gradients and the look-ahead (3.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from parenting.experiments.figure2.report import report
from parenting.experiments.figure2.settings import (
    ARMS,
    BASELINES,
    COMBINATIONS,
    COVER,
    MAX_TICKS,
    PRESET,
    TRIED,
    Arm,
)
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results
from parenting.experiments.training.gardens import GAMMA


def _config(request: Request) -> Mapping[str, Any]:
    return {
        "preset": PRESET,
        "gamma": GAMMA,
        "combinations": COMBINATIONS,
        "lives": {scale: {name: _plain(one) for name, one in arms.items()} for scale, arms in ARMS.items()},
        "lines": {scale: [*lines[:-1], sorted(lines.stages.items())] for scale, lines in BASELINES.items()},
        "cover": COVER,
        "max_ticks": MAX_TICKS,
    }


def _plain(arm: Arm) -> Mapping[str, Any]:
    """By the names that results.json publishes."""
    fields = arm._asdict()
    return {"share": fields.pop("cost"), **fields}


def _tasks(request: Request) -> list[Task]:
    return [*_arms(request), *_rewards(request), *_aheads(request), *_covers(request)]


def _arms(request: Request) -> list[Task]:
    tasks = []
    for name, arm in ARMS[request.scale].items():
        for level, inside in COMBINATIONS if arm.everywhere else (TRIED,):
            words = name.replace(", ", "-").replace(" ", "-").replace(",", "")
            key = f"{request.scale}-{words}-{level}-{inside}"
            mine = {
                "label": name,
                "level": level,
                "inside": inside,
                "changes": dict(arm.changes),
                "every": arm.every,
                "milestones": arm.milestones,
                "starts": arm.starts,
                "max_ticks": MAX_TICKS,
                "trials": request.trials,
                "seed": request.seed,
            }
            cost = arm.cost * request.trials
            tasks.append(
                Task(
                    f"{key}-{request.trials:03d}",
                    "parenting.experiments.figure2.tasks:arm_trials",
                    mine,
                    cost,
                )
            )
    return tasks


def _rewards(request: Request) -> list[Task]:
    evaluation_points = BASELINES[request.scale].evaluation_points
    return [
        Task(
            f"{request.scale}-rewards-{level}-{request.trials:03d}",
            "parenting.experiments.figure2.tasks:reinforce_trials",
            {
                "level": level,
                "evaluation_points": evaluation_points,
                "trials": request.trials,
                "seed": request.seed,
            },
            evaluation_points[-1] / 100 * request.trials,
        )
        for level in dict(COMBINATIONS)
    ]


def _aheads(request: Request) -> list[Task]:
    lines = BASELINES[request.scale]
    return [
        Task(
            f"{request.scale}-ahead-{level}-{inside}-{depth}",
            "parenting.experiments.figure2.tasks:lookahead_waterings",
            {"level": level, "inside": inside, "depth": depth, "episodes": lines.episodes},
            4.0 ** (depth - 5),
        )
        for level, inside in COMBINATIONS
        for depth in range(lines.depth + 1)
    ]


def _covers(request: Request) -> list[Task]:
    lines = BASELINES[request.scale]
    return [
        Task(
            f"{request.scale}-cover-{level}-{inside}",
            "parenting.experiments.figure2.tasks:full_coverage_stages",
            {
                "level": level,
                "inside": inside,
                "changes": COVER,
                "stages": stages,
                "budget": lines.budget,
                "trial": 0,
                "seed": request.seed,
            },
            45.0 * stages,
        )
        for (level, inside), stages in lines.stages.items()
    ]


def _report(request: Request, rows: Sequence[Row]) -> Results:
    return report(rows, ARMS[request.scale], BASELINES[request.scale])


EXPERIMENT = Experiment(
    name="figure2",
    title="Figure 2: maturation in the garden",
    section="3.3",
    claim="Maturing through T = 1 to 4, the agent outperforms its parent and approaches policy gradients. "
    "Policy gradients water more than 5 plants in an episode of 10 steps, the parent about 2.",
    trials={"quick": 1, "paper": 3},
    config=_config,
    tasks=_tasks,
    report=_report,
)
