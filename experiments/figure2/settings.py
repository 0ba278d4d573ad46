"""Settings of Figure 2: arms, and the baselines that they are compared with, at each scale (Sec. 3.3)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from parenting.experiments.spec import Scale

PRESET = "conservative"
COMBINATIONS = tuple(
    (level, inside) for level in ("garden", "garden-mirrored") for inside in ("up-down", "left")
)
"""Both gardens, both parents."""


TRIED = ("garden-mirrored", "up-down")
"""Garden and parent of the ablations: its parent leaves most to learn, as in the paper's figure."""


class Arm(NamedTuple):
    """Settings with which agents are parented through their stages."""

    changes: Mapping[str, Any]  # to the conservative preset
    every: int  # queries of a stage
    milestones: tuple[int, ...]  # queries after which they are evaluated
    cost: float  # of a trial, relative to other arms
    everywhere: bool = False  # in all gardens, with all parents
    starts: bool = False  # episodes of parenting begin anywhere on bare soil


ASKS = {"batch": 32, "p_guid": 0.99}
"""Settings with which an agent keeps asking: with 0.95, three agents had 3800 answers after 100,000 ticks."""


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
"""The arms of each scale by their names in trials.csv. Task results of both scales may lie in one folder."""


class Budget(NamedTuple):
    """The work of a stage of the full-coverage agent."""

    episodes: int
    rounds: int  # of walking, asking and training
    passes: int  # over X, in each round


class Baselines(NamedTuple):
    """The baselines of one scale."""

    depth: int  # of the look-ahead
    episodes: int
    evaluation_points: tuple[int, ...]  # gradient steps after which policy gradients are evaluated
    budget: Budget  # of the full-coverage agent
    stages: Mapping[tuple[str, str], int]  # of the full-coverage agent


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
