"""Agents that begin with what an earlier one has: the weights of its policy, or the answers of its parent.

Familiarity begins at zero all the same, so such an agent asks before it acts, as any other (Sec. 2.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import torch
from jaxtyping import Float
from torch import Tensor

from parenting.agent import guidance
from parenting.agent.config import Config
from parenting.agent.query import Answer
from parenting.agent.state import AgentState


class Beginning(NamedTuple):
    """The part of an earlier life that agents begin with; tensors only, so that it travels to processes."""

    weights: Float[Tensor, "P"] | None = None  # of an earlier policy; None: fresh or pre-trained ones
    answers: Sequence[Answer] = ()  # one trial each, in the order in which they were heard


FRESH = Beginning()


def inherit(config: Config, state: AgentState, answers: Sequence[Answer]) -> AgentState:
    """Put earlier answers into X (Sec. 2.3) of agents at tick 0.

    Args:
        config: The hyperparameters.
        state: N agents, as `init` makes them.
        answers: One trial each, in the order in which they were heard; every agent has all of them.
    """
    if not answers:
        return state
    one = state.pick(torch.tensor([0], device=state.waiting.device))
    for answer in answers:
        one = one.replace(x=guidance.store(config, one, answer))
    return state.replace(x=one.x.pick(torch.zeros_like(state.answered)))
