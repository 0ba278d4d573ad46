"""The substitute for a human parent (Sec. 3.1.3): prefers the clip with the greater advantage, refuses what
is unsafe.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from jaxtyping import Bool, Int64
from torch import Tensor

from agent.events import Event
from agent.query import Answer, Choice, Kind, Query
from agent.state import AgentState
from envs.gridworld import Gridworld
from parents.model import Model, explore
from parents.values import Values, advantage, optimal, visited

TIE = 1e-6
"""Advantages within this are *either* (ours)."""


class Judgement:
    """What the scripted parent thinks of queries: a function of what they hold, the world's rules and its
    values.
    """

    def __init__(
        self, world: Gridworld, gamma: float, model: Model | None = None, values: Values | None = None
    ) -> None:
        """Work out the exact values of `world`; other values may be given, such as those of a sub-optimal
        policy.
        """
        self.model = explore(world) if model is None else model
        self.values = optimal(self.model, gamma) if values is None else values

    def choose(self, query: Query) -> Int64[Tensor, "N"]:
        """Left or right by Eq. (7), *either* on a tie, *neither* where both moves of a guidance query are
        unsafe.
        """
        alpha = advantage(self.model, self.values, query)
        margin = alpha[:, 0] - alpha[:, 1]
        choice = torch.where(margin > 0, int(Choice.LEFT), int(Choice.RIGHT))
        choice = torch.where(margin.abs() <= TIE, int(Choice.EITHER), choice)
        choice = torch.where(self.refuses(query), int(Choice.NEITHER), choice)
        return torch.where(query.kind == Kind.NONE, int(Choice.NONE), choice)

    def refuses(self, query: Query) -> Bool[Tensor, "N"]:
        """Both actions of a guidance query are unsafe; never so for clips."""
        first = visited(self.model, query)[:, :, 0]
        unsafe = self.model.unsafe[first].gather(-1, query.action[:, :, :1]).squeeze(-1)
        return unsafe.all(1) & (query.kind == Kind.GUIDANCE)


class ScriptedParent:
    """Answers every query in the tick after it was asked."""

    def __init__(self, judgement: Judgement, query: Query) -> None:
        """Begin with `query`, the empty query of the run."""
        self.judgement, self.query = judgement, query

    def take(self, state: AgentState) -> Answer:
        """The answers to what was asked a tick ago."""
        return Answer(query=self.query, choice=self.judgement.choose(self.query))

    def post(self, query: Query) -> None:
        """Remember what is asked."""
        self.query = query

    def events(self, state: AgentState) -> Sequence[Event]:
        """A scripted parent has no operator."""
        return ()

    def pick(self, index: Tensor) -> None:
        """Go on with some of the trials alone."""
        self.query = self.query.pick(index)
