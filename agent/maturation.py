"""Maturation: from policies that look one step ahead to policies that look further (Sec. 2.4)."""

from __future__ import annotations

from jaxtyping import Bool, Int64
from torch import Tensor

from parenting.agent import dataset, pairing
from parenting.agent.config import Config
from parenting.agent.state import AgentState, Learner


def grow(config: Config, state: AgentState) -> AgentState:
    """pi_T -> pi_{T+1} where the stage's budget of answered queries is spent."""
    if config.queries_per_stage is None:
        return state
    return mature(config, state, state.answered >= config.queries_per_stage)


def mature(config: Config, state: AgentState, ripe: Bool[Tensor, "N"]) -> AgentState:
    """Freeze pi_T and go on with pi_{T+1}, its copy; the last stage never ends.

    The running clip is dropped, the recorder emptied, and Adam's moments are reset. Steps that pi_T
    still owed are not taken.
    """
    ripe = ripe & (state.maturity < config.max_clip_length)
    if not bool(ripe.any()):
        return state
    return state.replace(
        learner=_freeze(state.learner, state.maturity, ripe),
        maturity=state.maturity + ripe,
        answered=state.answered.masked_fill(ripe, 0),
        recorder=pairing.forget(state.recorder, ripe),
        x=dataset.clear(state.x, ripe) if config.own_stage_only else state.x,
    )


def _freeze(learner: Learner, maturity: Int64[Tensor, "N"], ripe: Bool[Tensor, "N"]) -> Learner:
    trial = ripe.nonzero().squeeze(1)
    frozen = learner.frozen.clone()
    frozen[maturity[trial] - 1, trial] = learner.params[trial]
    return learner.replace(
        frozen=frozen,
        exp_avg=learner.exp_avg.masked_fill(ripe[:, None], 0),
        exp_avg_sq=learner.exp_avg_sq.masked_fill(ripe[:, None], 0),
        steps=learner.steps.masked_fill(ripe, 0),
        owed=learner.owed & ~ripe,
    )
