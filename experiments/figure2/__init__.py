"""Figure 2: waterings as the agent matures, against its parent, policy gradients and the look-ahead (3.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from parenting.experiments.figure2.full_coverage import Budget
from parenting.experiments.figure2.report import report
from parenting.experiments.figure2.tasks import PRESET
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results, Scale
from parenting.experiments.training.gardens import GAMMA

COMBINATIONS = tuple(
    (level, inside) for level in ("garden", "garden-mirrored") for inside in ("up-down", "left")
)
"""Both gardens, both parents."""
TRIED = ("garden-mirrored", "up-down")
"""Where the levers are tried: the parent leaves most to be learnt there, as in the paper's figure."""


class Arm(NamedTuple):
    """How agents are raised through their stages."""

    changes: Mapping[str, Any]  # to the conservative preset
    every: int  # queries of a stage
    milestones: tuple[int, ...]  # queries after which they are looked at
    cost: float  # of the work
    everywhere: bool = False  # in all gardens, by all parents
    starts: bool = False  # episodes of parenting begin anywhere on bare soil


ASKS = {"batch": 32, "p_guid": 0.99}
"""What makes an agent go on asking: with 0.95, three agents had 3800 answers after 100,000 ticks."""
ARMS: dict[Scale, dict[str, Arm]] = {
    "quick": {
        "more guidance": Arm(ASKS, 15, (15, 30), 1, everywhere=True),
        "conservative": Arm({"batch": 32}, 15, (15, 30), 1),
        "more guidance, starts spread": Arm(ASKS, 15, (15, 30), 1, starts=True),
    },
    "paper": {
        "more guidance": Arm(ASKS, 1000, (1000, 2000, 3000, 4000, 5000, 6000), 20, everywhere=True),
        "conservative": Arm({"batch": 32}, 1000, (1000, 2000, 3000, 4000), 60),
        "more guidance, starts spread": Arm(ASKS, 1000, (1000, 2000, 3000, 4000), 15, starts=True),
        "more guidance, own length": Arm({**ASKS, "own_length": True}, 1000, (1000, 2000, 3000), 11),
        "more guidance, 4 gradient steps": Arm({**ASKS, "gradient_steps": 4}, 1000, (1000, 2000), 20),
        "more guidance, pre-trained": Arm({**ASKS, "pretrain": True}, 1000, (1000, 2000), 30),
        "10,000 a stage": Arm(
            {"batch": 64, "p_guid": 0.999, "p_rec": 1.0, "p_pref": 1.0, "p_train": 0.5},
            10_000,
            (1000, 2000, 5000, 10_000, 12_000),
            54,
        ),
    },
}
"""The lives of each scale; their pieces and those of the other scale may lie in one folder."""


class Baselines(NamedTuple):
    """What the lives are held against."""

    depth: int  # of the look-ahead
    episodes: int
    evaluation_points: tuple[int, ...]  # gradient steps after which policy gradients are looked at
    budget: Budget  # of the coverage agent
    stages: Mapping[tuple[str, str], int]  # of the coverage agent


BASELINES: dict[Scale, Baselines] = {
    "quick": Baselines(3, 200, (10, 20), Budget(30, 2, 10), {TRIED: 1}),
    "paper": Baselines(
        6,
        1000,
        (1000, 2000),
        Budget(150, 8, 50),
        {each: 4 if each == TRIED else 1 for each in COMBINATIONS},
    ),
}
COVER = {"learning_rate": 0.003}
MAX_TICKS = 400_000


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
    claim="Matured through T = 1 .. 4, an agent outperforms its parent at once and comes close to policy "
    "gradients, which water more than 5 plants in an episode of 10 steps; the parent waters about 2.",
    trials={"quick": 1, "paper": 3},
    config=_config,
    tasks=_tasks,
    report=_report,
)
