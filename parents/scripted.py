"""The scripted parent (Sec. 3.1.3): prefers the clip with the greater advantage, refuses unsafe moves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import torch
from jaxtyping import Bool, Int64
from torch import Tensor

from parenting.agent.config import GardenParent
from parenting.agent.events import Event
from parenting.agent.query import Answer, Choice, Query, QueryKind
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld
from parenting.envs.mdp import Model
from parenting.parents.values import TabularValues, Values, exact_values

TIE = 1e-6
"""Advantages within this are *either* (ours)."""


class ScriptedRule:
    """The rule of the scripted parent: a function of the query, the world's rules and its values."""

    def __init__(
        self,
        world: Gridworld,
        gamma: float,
        values: Values | None = None,
        inside: GardenParent = "up-down",
    ) -> None:
        """Compute the exact values of `world`, unless other values are given.

        Those may be the values of a sub-optimal policy. `inside` is how the garden's parent walks inside its
        cycle (Sec. 3.3).

        Raises:
            ValueError: too many states to list; in the garden, gamma is 1 or there is no such `inside`.
        """
        self.values = exact_values(world, gamma, inside) if values is None else values

    @property
    def model(self) -> Model:
        """The list of all states.

        Raises:
            TypeError: in the garden, whose states are not listed.
        """
        if not isinstance(self.values, TabularValues):
            raise TypeError("This world's values are in closed form: there is no list of its states.")
        return self.values.model

    def answer(self, query: Query) -> Int64[Tensor, "N"]:
        """Answer by Eq. (7): the better side, or *either* on a tie.

        The answer is *neither* where both moves of a guidance query are unsafe."""
        gap = self.values.advantage_gap(query)
        choice = torch.where(gap > 0, int(Choice.LEFT), int(Choice.RIGHT))
        choice = torch.where(gap.abs() <= TIE, int(Choice.EITHER), choice)
        choice = torch.where(self.refuses(query), int(Choice.NEITHER), choice)
        return torch.where(query.kind == QueryKind.NONE, int(Choice.NONE), choice)

    def refuses(self, query: Query) -> Bool[Tensor, "N"]:
        """Both actions of a guidance query are unsafe; never so for clips."""
        return self.values.unsafe(query).all(1) & (query.kind == QueryKind.GUIDANCE)


class Rule(Protocol):
    """A parent's judgement as a function of the query alone."""

    def answer(self, query: Query) -> Int64[Tensor, "N"]:
        """Return each trial's `Choice`; `Choice.NONE` where it asks nothing."""
        ...


class ScriptedParent:
    """Answers every query by a rule, in the tick after it was asked."""

    def __init__(self, rule: Rule, query: Query) -> None:
        """Begin with `query`, the empty query of the run."""
        self.rule, self.query = rule, query

    def take(self, state: AgentState) -> Answer:
        """The answers to what was asked a tick ago."""
        silent = not bool(self.query.kind.any())  # as in most ticks of a single trial
        choice = torch.zeros_like(self.query.kind) if silent else self.rule.answer(self.query)
        return Answer(query=self.query, choice=choice)

    def post(self, query: Query) -> None:
        """Remember what is asked."""
        self.query = query

    def events(self, state: AgentState) -> Sequence[Event]:
        """A scripted parent has no operator."""
        return ()

    def pick(self, index: Tensor) -> None:
        """Go on with some of the trials alone."""
        self.query = self.query.pick(index)
