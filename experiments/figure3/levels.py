"""The levels of Figure 3: random ones that only moving the box solves, and the pre-trained agent does not.

Each is written as a row of plain data, so that other tasks and the report read them from there.
"""

from __future__ import annotations

from collections.abc import Sequence

from parenting.agent.config import Config, compose
from parenting.agent.init import world_of
from parenting.envs import registry
from parenting.envs.levels.spec import Level
from parenting.envs.mdp import explore
from parenting.envs.random_boxes import box_levels, shortest, tempts
from parenting.evaluation.argmax import ArgmaxPolicy, TabularEvaluation
from parenting.evaluation.outcomes import Outcome, follow, name, outcome
from parenting.experiments.runner.store import Row
from parenting.weights.store import pretrained

WORLD, PRESET = "side-effects", "conservative"
HEIGHT, WIDTH = 6, 6
PARENTING, SET_ASIDE = "parenting", "set aside"
SOLVED = (Outcome.OPTIMAL, Outcome.DETOUR)
"""At the goal by safe moves. A way that leaves the box stuck solves nothing."""


def config_of(pretrain: bool, recompare: bool) -> Config:
    """The conservative preset with the world's own settings, and these two."""
    changes = {"pretrain": pretrain, "recompare": recompare}
    return compose(PRESET, registry.defaults(WORLD), changes, strict=True)


def find_levels(parenting: int, aside: int, seed: int) -> list[Row]:
    """The first levels of a seed that are not solved already: some for parenting, the others set aside."""
    wanted, drawn = parenting + aside, 0
    kept: list[Row] = []
    while len(kept) < wanted:
        drawn = max(2 * drawn, 2 * wanted)
        levels = box_levels(drawn, HEIGHT, WIDTH, seed)
        found = zip(levels, outcomes(levels), strict=True)
        kept = [_row(number, *one) for number, one in enumerate(found, start=1) if one[1] not in SOLVED]
    uses = [PARENTING] * parenting + [SET_ASIDE] * aside
    return [{**row, "for": use} for row, use in zip(kept, uses, strict=False)]


def outcomes(levels: Sequence[Level]) -> list[Outcome]:
    """Return the outcome of the shipped weights' argmax policy on each level."""
    world = world_of(WORLD, levels, config_of(pretrain=True, recompare=False))
    judged = TabularEvaluation(world, explore(world), gamma=1.0)
    policy = ArgmaxPolicy(judged, pretrained(world).to(judged.starts.device).repeat(len(levels), 1))
    path = follow(judged.model, policy, judged.starts, world.time_limit)
    return [Outcome(one) for one in outcome(judged.model, judged.distance, path).tolist()]


def _row(drawn: int, level: Level, done: Outcome) -> Row:
    return {
        "of": "level",
        "drawn": drawn,  # its number among all that were drawn
        "level": "/".join(level.rows),
        "steps": shortest(level, safe=True),
        "tempts": tempts(level),
        "outcome": name(done, registry.spec(WORLD).harm),
    }


def levels_for(use: str, rows: Sequence[Row]) -> list[Level]:
    """The levels of one use, from the rows of `find_levels` among others."""
    mine = [row for row in rows if row["of"] == "level" and row["for"] == use]
    return [Level(f"drawn-{row['drawn']}", WORLD, tuple(row["level"].split("/"))) for row in mine]
