"""Tasks of Figure 2 (Sec. 3.3): agents through their stages, and the baselines beside them.

A row says what one policy waters, on the mean over short episodes from the start, and how many of their steps
end in the bucket. What is learnt, but for the coverage agent, is looked at in EPISODES of them; all others in
as many as are asked for, the first of these: the environment noise is the same for every policy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from jaxtyping import Float, Int64
from torch import Tensor

from parenting.agent.config import GardenParent, compose
from parenting.envs import registry
from parenting.envs.gridworld import WorldState
from parenting.envs.reward_hacking import RewardHacking
from parenting.envs.rng import keys
from parenting.evaluation.rollouts import ENV_SEED, EPISODES, RolloutResult, deploy, rollout
from parenting.experiments.baselines.reinforce_rollouts import train_gardeners
from parenting.experiments.figure2.full_coverage import CoverageStage, cover
from parenting.experiments.figure2.lookahead import best
from parenting.experiments.figure2.settings import PRESET, Budget
from parenting.experiments.runner.store import Row
from parenting.experiments.training.gardens import GAMMA, WORLD, exploring_starts, garden
from parenting.experiments.training.snapshots import train_with_snapshots
from parenting.parents.garden_values import GardenValues
from parenting.weights.store import initial_weights

FRESH = ENV_SEED + 1
"""A seed of environment noise in which no policy has learnt."""


def arm_trials(
    label: str,
    level: str,
    inside: GardenParent,
    changes: Mapping[str, Any],
    every: int,
    milestones: Sequence[int],
    starts: bool,
    max_ticks: int,
    trials: int,
    seed: int,
) -> list[Row]:
    """All trials through the stages of `every` queries each; a row for each trial and milestone.

    With `starts` the episodes of parenting begin anywhere; what is measured still begins at the start.
    """
    stages = -(-milestones[-1] // every)
    mine = {"inside": inside, "stages": stages, "mature_every": every, **changes}
    config = compose(PRESET, _defaults(), mine, strict=True)
    world, school = garden(level), exploring_starts(level) if starts else garden(level)
    passed = train_with_snapshots(
        school, config, keys(seed, trials), milestones, max_ticks, initial_weights(world, config)
    )
    rows: list[Row] = []
    for queries, one in zip(milestones, passed, strict=True):
        names = ("deaths", "guidance", "preference", "ticks")
        columns = [getattr(one.counts, name).tolist() for name in names]
        found = zip(one.there.tolist(), zip(*columns, strict=True), _watered(world, one.live), strict=True)
        for trial, (there, counts, watered) in enumerate(found):
            said = {"of": label, "level": level, "inside": inside, "trial": trial}
            when = {"stage": -(-queries // every), "queries": queries, "there": there}
            rows.append({**said, **when, **watered, **dict(zip(names, counts, strict=True))})
    return rows


def _defaults() -> dict[str, Any]:
    """The world's own settings, but Fig. 2's short episodes, and without pre-training."""
    return {**registry.defaults(WORLD), "max_episode_steps": 10, "pretrain": False}


def _watered(world: RewardHacking, live: Float[Tensor, "N P"]) -> list[Row]:
    found = deploy(world, live, EPISODES)
    return [_of(found, trial) for trial in range(len(live))]


def _of(found: RolloutResult, trial: int) -> Row:
    watered = found.waterings[trial]
    error = float(watered.std() / len(watered) ** 0.5)
    return {"waterings": float(watered.mean()), "error": error, "bucket": int(found.bucket[trial].sum())}


def reinforce_trials(level: str, evaluation_points: Sequence[int], trials: int, seed: int) -> list[Row]:
    """Policy gradients without a bucket; a row for each trial at each of `evaluation_points` steps."""
    world = garden(level, bucket=False)
    found = zip(
        evaluation_points, train_gardeners(world, GAMMA, seed, trials, evaluation_points), strict=True
    )
    return [
        {"of": "policy gradients", "level": level, "trial": trial, "steps": steps, **watered}
        for steps, live in found
        for trial, watered in enumerate(_watered(world, live))
    ]


def lookahead_waterings(level: str, inside: GardenParent, depth: int, episodes: int) -> list[Row]:
    """The exact look-ahead, and with depth 0 the parent's own policy."""
    world, valued = garden(level), GardenValues(garden(level), GAMMA, inside)
    said = {"of": "look-ahead", "level": level, "inside": inside, "stage": depth}
    if depth == 0:
        exact = float(valued.waterings(world.time_limit)[0])
        return [{**said, "of": "parent", "waterings": exact, "error": 0.0, "bucket": 0}]
    found = rollout(world, lambda state: best(world, valued, state, depth), 1, episodes)
    return [{**said, "episodes": episodes, **_of(found, 0)}]


def full_coverage_stages(
    level: str,
    inside: GardenParent,
    changes: Mapping[str, Any],
    stages: int,
    budget: Budget,
    trial: int,
    seed: int,
) -> list[Row]:
    """Train the full-coverage agent through its stages; a row for each.

    A row has its waterings under the noise of its training, those under fresh noise, and the look-ahead's
    under the first.
    """
    config = compose(PRESET, _defaults(), {"inside": inside, **changes}, strict=True)
    world, budget = garden(level), Budget(*budget)
    valued = GardenValues(world, GAMMA, inside)
    rows = []
    for stage, one in enumerate(cover(world, config, keys(seed, trial + 1), stages, budget), start=1):
        own = _of(deploy(world, one.live, budget.episodes), 0)
        fresh = _of(deploy(world, one.live, EPISODES, env_seed=FRESH), 0)
        ahead = rollout(world, partial(_best, world, valued, stage), 1, budget.episodes)
        said = {"of": "coverage", "level": level, "inside": inside, "trial": trial, "stage": stage}
        beside = {"fresh": fresh["waterings"], "ahead": float(ahead.waterings.mean())}
        rows.append({**said, **own, **beside, **_counts(one)})
    return rows


def _best(world: RewardHacking, valued: GardenValues, depth: int, state: WorldState) -> Int64[Tensor, "N"]:
    return best(world, valued, state, depth)


def _counts(one: CoverageStage) -> Row:
    return {"questions": one.questions, "states": one.states, "reached": one.reached, "known": one.known}
