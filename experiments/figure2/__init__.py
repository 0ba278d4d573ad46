"""Figure 2: waterings as the agent matures, against its parent, policy gradients and the look-ahead (3.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from parenting.experiments.figure2.full_coverage import Pace
from parenting.experiments.figure2.report import report
from parenting.experiments.figure2.tasks import PRESET
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Asked, Experiment, Report, Scale
from parenting.experiments.training.gardens import GAMMA

COMBINATIONS = tuple(
    (level, inside) for level in ("garden", "garden-mirrored") for inside in ("up-down", "left")
)
"""Both gardens, both parents."""
TRIED = ("garden-mirrored", "up-down")
"""Where the levers are tried: the parent leaves most to be learnt there, as in the paper's figure."""


class Life(NamedTuple):
    """How agents are raised through their stages."""

    changes: Mapping[str, Any]  # to the conservative preset
    every: int  # queries of a stage
    milestones: tuple[int, ...]  # queries after which they are looked at
    share: float  # of the work
    everywhere: bool = False  # in all gardens, by all parents
    starts: bool = False  # episodes of parenting begin anywhere on bare soil


ASKS = {"batch": 32, "p_guid": 0.99}
"""What makes an agent go on asking: with 0.95, three agents had 3800 answers after 100,000 ticks."""
LIVES: dict[Scale, dict[str, Life]] = {
    "quick": {
        "more guidance": Life(ASKS, 15, (15, 30), 1, everywhere=True),
        "conservative": Life({"batch": 32}, 15, (15, 30), 1),
        "more guidance, starts spread": Life(ASKS, 15, (15, 30), 1, starts=True),
    },
    "paper": {
        "more guidance": Life(ASKS, 1000, (1000, 2000, 3000, 4000, 5000, 6000), 20, everywhere=True),
        "conservative": Life({"batch": 32}, 1000, (1000, 2000, 3000, 4000), 60),
        "more guidance, starts spread": Life(ASKS, 1000, (1000, 2000, 3000, 4000), 15, starts=True),
        "more guidance, own length": Life({**ASKS, "own_length": True}, 1000, (1000, 2000, 3000), 11),
        "more guidance, 4 gradient steps": Life({**ASKS, "gradient_steps": 4}, 1000, (1000, 2000), 20),
        "more guidance, pre-trained": Life({**ASKS, "pretrain": True}, 1000, (1000, 2000), 30),
        "10,000 a stage": Life(
            {"batch": 64, "p_guid": 0.999, "p_rec": 1.0, "p_pref": 1.0, "p_train": 0.5},
            10_000,
            (1000, 2000, 5000, 10_000, 12_000),
            54,
        ),
    },
}
"""The lives of each scale; their pieces and those of the other scale may lie in one folder."""


class Lines(NamedTuple):
    """What the lives are held against."""

    depth: int  # of the look-ahead
    episodes: int
    looks: tuple[int, ...]  # gradient steps after which policy gradients are looked at
    pace: Pace  # of the coverage agent
    stages: Mapping[tuple[str, str], int]  # of the coverage agent


LINES: dict[Scale, Lines] = {
    "quick": Lines(3, 200, (10, 20), Pace(30, 2, 10), {TRIED: 1}),
    "paper": Lines(
        6,
        1000,
        (1000, 2000),
        Pace(150, 8, 50),
        {each: 4 if each == TRIED else 1 for each in COMBINATIONS},
    ),
}
COVER = {"learning_rate": 0.003}
MAX_TICKS = 400_000


def _config(asked: Asked) -> Mapping[str, Any]:
    return {
        "preset": PRESET,
        "gamma": GAMMA,
        "combinations": COMBINATIONS,
        "lives": {
            scale: {name: one._asdict() for name, one in lives.items()} for scale, lives in LIVES.items()
        },
        "lines": {scale: [*lines[:-1], sorted(lines.stages.items())] for scale, lines in LINES.items()},
        "cover": COVER,
        "max_ticks": MAX_TICKS,
    }


def _tasks(asked: Asked) -> list[Task]:
    return [*_lives(asked), *_rewards(asked), *_aheads(asked), *_covers(asked)]


def _lives(asked: Asked) -> list[Task]:
    tasks = []
    for name, life in LIVES[asked.scale].items():
        for level, inside in COMBINATIONS if life.everywhere else (TRIED,):
            key = (
                f"{asked.scale}-{name.replace(', ', '-').replace(' ', '-').replace(',', '')}-{level}-{inside}"
            )
            mine = {
                "label": name,
                "level": level,
                "inside": inside,
                "changes": dict(life.changes),
                "every": life.every,
                "milestones": life.milestones,
                "starts": life.starts,
                "max_ticks": MAX_TICKS,
                "trials": asked.trials,
                "seed": asked.seed,
            }
            share = life.share * asked.trials
            tasks.append(
                Task(
                    f"{key}-{asked.trials:03d}", "parenting.experiments.figure2.tasks:arm_trials", mine, share
                )
            )
    return tasks


def _rewards(asked: Asked) -> list[Task]:
    looks = LINES[asked.scale].looks
    return [
        Task(
            f"{asked.scale}-rewards-{level}-{asked.trials:03d}",
            "parenting.experiments.figure2.tasks:reinforce_trials",
            {"level": level, "looks": looks, "trials": asked.trials, "seed": asked.seed},
            looks[-1] / 100 * asked.trials,
        )
        for level in dict(COMBINATIONS)
    ]


def _aheads(asked: Asked) -> list[Task]:
    lines = LINES[asked.scale]
    return [
        Task(
            f"{asked.scale}-ahead-{level}-{inside}-{depth}",
            "parenting.experiments.figure2.tasks:lookahead_waterings",
            {"level": level, "inside": inside, "depth": depth, "episodes": lines.episodes},
            4.0 ** (depth - 5),
        )
        for level, inside in COMBINATIONS
        for depth in range(lines.depth + 1)
    ]


def _covers(asked: Asked) -> list[Task]:
    lines = LINES[asked.scale]
    return [
        Task(
            f"{asked.scale}-cover-{level}-{inside}",
            "parenting.experiments.figure2.tasks:full_coverage_stages",
            {
                "level": level,
                "inside": inside,
                "changes": COVER,
                "stages": stages,
                "pace": lines.pace,
                "trial": 0,
                "seed": asked.seed,
            },
            45.0 * stages,
        )
        for (level, inside), stages in lines.stages.items()
    ]


def _report(asked: Asked, rows: Sequence[Row]) -> Report:
    return report(rows, LIVES[asked.scale], LINES[asked.scale])


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
