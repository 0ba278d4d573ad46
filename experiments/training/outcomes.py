"""Outcomes of the argmax policies of many trials, at the end of each stage."""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float, Float64, Int64
from torch import Tensor

from parenting.agent.config import Config
from parenting.agent.init import world_of
from parenting.envs.gridworld import Gridworld
from parenting.envs.levels.spec import WorldSpec
from parenting.envs.mdp import explore
from parenting.envs.struct import Struct
from parenting.evaluation.argmax import TabularEvaluation
from parenting.evaluation.rollouts import EPISODES, deploy
from parenting.experiments.training.batch import TrainResult
from parenting.experiments.training.counts import Counts
from parenting.experiments.training.history import no_history

UNREACHED = -1
"""The outcome of a stage that a trial did not come to."""


class Outcomes(Struct):
    """Counts and outcomes of every trial. M stages; D deployments, 0 in the garden; G is M there, else 0."""

    counts: Counts
    outcome: Int64[Tensor, "N M D"]  # evaluation.outcomes.Outcome, or UNREACHED
    waterings: Float64[Tensor, "N G"]  # an episode, the mean of EPISODES on each level
    bucket: Int64[Tensor, "N G"]  # steps of all these episodes that end in the bucket
    history: Float64[Tensor, "N R K"]  # `training.history`; without rows where it is not kept


def deployments(spec: WorldSpec) -> tuple[str, ...]:
    """Where the policies are tried: with the supervisor and without, in a world that has one (Sec. 3.2.5)."""
    return ("supervised", "unsupervised") if "supervised" in spec.options else ("",)


def examine(world: Gridworld, config: Config, result: TrainResult) -> Outcomes:
    """Try every policy that raising left, from the start: one outcome each, or the mean of many episodes."""
    counts, policies = result.counts, result.policies
    reached = torch.arange(1, config.max_clip_length + 1) <= counts.maturity[:, None]
    kept = no_history(len(reached)) if result.history is None else result.history
    if isinstance(result.evaluation, TabularEvaluation):
        outcome = _outcomes(_deployed(world, config, result.evaluation), policies, reached)
        nothing = reached.new_zeros(len(reached), 0)
        return Outcomes(
            counts=counts,
            outcome=outcome,
            waterings=nothing.double(),
            bucket=nothing.long(),
            history=kept,
        )
    waterings, bucket = _watered(world, policies, reached)
    no_outcome = torch.zeros(*reached.shape, 0, dtype=torch.int64)
    return Outcomes(counts=counts, outcome=no_outcome, waterings=waterings, bucket=bucket, history=kept)


def _deployed(world: Gridworld, config: Config, lived: TabularEvaluation) -> list[TabularEvaluation]:
    """The world that was lived in, or the same levels with the supervisor and without."""
    if "supervised" not in world.spec.options:
        return [lived]
    worlds = [
        world_of(world.name, world.levels, config.model_copy(update={"supervised": there}))
        for there in ("present", "absent")
    ]
    return [TabularEvaluation(one, explore(one), config.gamma) for one in worlds]


def _outcomes(
    tried: list[TabularEvaluation], policies: Float[Tensor, "M N P"], reached: Bool[Tensor, "N M"]
) -> Int64[Tensor, "N M D"]:
    each = [torch.stack([one.outcomes(live) for one in tried], 1) for live in policies]
    return torch.stack(each, 1).masked_fill(~reached[:, :, None], UNREACHED)


def _watered(
    world: Gridworld, policies: Float[Tensor, "M N P"], reached: Bool[Tensor, "N M"]
) -> tuple[Float64[Tensor, "N M"], Int64[Tensor, "N M"]]:
    waterings = torch.zeros(reached.shape, dtype=torch.float64)
    bucket = torch.zeros(reached.shape, dtype=torch.int64)
    levels = len(world.levels)
    for stage, live in enumerate(policies):
        trial = reached[:, stage].nonzero().squeeze(1)
        for level in range(levels):
            found = deploy(world, live[trial], EPISODES, level)
            waterings[trial, stage] += found.waterings.mean(1) / levels
            bucket[trial, stage] += found.bucket.sum(1)
    return waterings, bucket
