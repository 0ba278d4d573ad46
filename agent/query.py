"""Queries and answers: two clips, and *left*, *right*, *either* or *neither* (Sec. 2.1, 2.2, Eq. 1).

Ours is *skip*: a parent who cannot tell. Nothing is learnt from it.
"""

from __future__ import annotations

from enum import IntEnum

import torch
from jaxtyping import Bool, Float64, Int64, UInt8
from torch import Tensor

from parenting.agent.choice import Choice as Choice
from parenting.envs.struct import Struct


class QueryKind(IntEnum):
    """The kind of a query: none, guidance before a move (Sec. 2.1), or a preference (Sec. 2.2)."""

    NONE = 0
    GUIDANCE = 1
    PREFERENCE = 2


class Query(Struct):
    """At most one question a trial and tick. Axis 2 is the side: 0 is shown left, 1 right.

    A clip holds `length` actions and `length + 1` frames; what lies beyond its length is zero.
    A guidance query is a pair of clips of length 1 whose second frame is the forecast of the move without
    chance.
    """

    kind: Int64[Tensor, "N"]
    observation: UInt8[Tensor, "N 2 T1 H W"]  # what the agent saw; T1 = T + 1
    board: UInt8[Tensor, "N 2 T1 H W"]  # what was true, without agent and box
    agent: Int64[Tensor, "N 2 T1 2"]  # row and column
    box: Int64[Tensor, "N 2 T1 2"]  # (-1, -1) where there is none
    action: Int64[Tensor, "N 2 T"]
    length: Int64[Tensor, "N 2"]  # clips may end early
    maturity: Int64[Tensor, "N"]  # the stage that the clips were recorded at; 1 for guidance
    level: Int64[Tensor, "N"]  # which of the world's levels
    votes: Int64[Tensor, "N"]  # guidance: answers heard on this pair in this pause; 0 for a first asking


class Answer(Struct):
    """The parent's answers, each with the query that it answers.

    A preference may be answered many ticks after it was asked.
    """

    query: Query
    choice: Int64[Tensor, "N"]

    @property
    def judges(self) -> Bool[Tensor, "N"]:
        """Return where the parent has answered and could tell."""
        return (self.choice != Choice.NONE) & (self.choice != Choice.SKIP)

    @property
    def mu(self) -> Float64[Tensor, "N 2"]:
        """Return mu of Eq. (1): [1, 0] for left, [0, 1] for right, [0.5, 0.5] for either.

        It is zero where there is nothing to learn.
        """
        return _MU.to(self.choice.device)[self.choice]


_MU = torch.tensor([[0, 0], [1, 0], [0, 1], [0.5, 0.5], [0, 0], [0, 0]], dtype=torch.float64)


def empty(trials: int, length: int, height: int, width: int, device: str | torch.device = "cpu") -> Query:
    """No query in any trial, for clips of up to `length` steps."""

    def zeros(*shape: int, dtype: torch.dtype = torch.int64) -> Tensor:
        return torch.zeros(trials, *shape, dtype=dtype, device=device)

    frames = (2, length + 1, height, width)
    return Query(
        kind=zeros(),
        observation=zeros(*frames, dtype=torch.uint8),
        board=zeros(*frames, dtype=torch.uint8),
        agent=zeros(2, length + 1, 2),
        box=zeros(2, length + 1, 2),
        action=zeros(2, length),
        length=zeros(2),
        maturity=zeros(),
        level=zeros(),
        votes=zeros(),
    )


def silence(query: Query) -> Answer:
    """No answer in any trial."""
    return Answer(query=query, choice=torch.zeros_like(query.kind))
