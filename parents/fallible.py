"""Parents who err: the scripted parent's answers, changed by the parts of a `ParentSpec` in turn (ours)."""

from __future__ import annotations

import torch
from jaxtyping import Int64
from torch import Tensor

from parenting.agent.config import GardenParent
from parenting.agent.query import Answer, Query, QueryKind
from parenting.agent.state import AgentState
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import Keys
from parenting.parents.asked import Asked
from parenting.parents.grammar import ParentSpec
from parenting.parents.scripted import ScriptedParent, ScriptedRule


class FallibleRule:
    """The answers of a parent as a function of the questions, their ticks and the number of answers before.

    An error is drawn by the trial's seed and the tick in which it asked, so that a run that is taken up again
    hears the same answers, and so do batches of any size.
    """

    def __init__(
        self,
        world: Gridworld,
        spec: ParentSpec,
        gamma: float,
        inside: GardenParent = "up-down",
        rule: ScriptedRule | None = None,
    ) -> None:
        """Compute the exact values of the world, by the discount of this parent.

        Args:
            world: The world.
            spec: The parent.
            gamma: The config's discount; a part may have its own.
            inside: How the garden's parent walks inside its cycle.
            rule: A rule of this world by `gamma`, whose values are taken where no part has its own discount.

        Raises:
            ValueError: as `ScriptedRule`.
        """
        own = gamma
        for part in spec.parts:
            own = part.discount(own)
        if rule is None or own != gamma:
            rule = ScriptedRule(world, own, inside=inside)
        self.spec, self.rule = spec, rule

    def answer(self, query: Query, keys: Keys, answers: Int64[Tensor, "N"]) -> Int64[Tensor, "N"]:
        """Return each trial's `Choice`.

        Args:
            query: The questions.
            keys: Of each trial, at the tick in which it asked.
            answers: How many answers the parent of each trial has given before.
        """
        asked = Asked(query, self.rule.values.advantage_gap(query), self.rule.refuses(query), keys, answers)
        choice = self.rule.answer(query)
        for place, part in enumerate(self.spec.parts):
            choice = part.change(asked, choice, place)
        return choice


class FallibleParent(ScriptedParent):
    """Answers a batch in the tick after it was asked, as a `ParentSpec` has it."""

    def __init__(self, fallible: FallibleRule, query: Query) -> None:
        """Begin with `query`, the empty query of the run."""
        super().__init__(fallible.rule, query)
        self.fallible, self.answers = fallible, torch.zeros_like(query.kind)

    def take(self, state: AgentState) -> Answer:
        """The answers to what was asked a tick ago: `state` is as that tick left it."""
        if not bool(self.query.kind.any()):  # as in most ticks of a single trial
            return Answer(query=self.query, choice=torch.zeros_like(self.query.kind))
        choice = self.fallible.answer(self.query, state.keys, self.answers)
        self.answers = self.answers + (self.query.kind != QueryKind.NONE)
        return Answer(query=self.query, choice=choice)

    def pick(self, index: Tensor) -> None:
        """Go on with some of the trials alone."""
        super().pick(index)
        self.answers = self.answers[index]
