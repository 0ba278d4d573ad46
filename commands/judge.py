"""A scripted parent of a question in the API's words, which are all that it knows (Sec. 3.1.3, and ours)."""

from __future__ import annotations

from typing import Any

import torch

from parenting.commands.errors import UsageError
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import keys
from parenting.parents.fallible import FallibleRule
from parenting.parents.grammar import SCRIPTED, ParentSpec
from parenting.server.codec import CHOICE_NAMES, decode


class Judge:
    """The judge of one run's questions. It makes the run's world from the first of them."""

    def __init__(self, spec: ParentSpec = SCRIPTED, seed: int = 0) -> None:
        """Judge as a parent does whose errors are drawn by the run's seed."""
        self.spec, self.keys = spec, keys(seed, 1)
        self._world: Gridworld | None = None
        self._rule: FallibleRule | None = None

    def choice(self, question: dict[str, Any], before: int = 0) -> str:
        """Return left, right, either, neither or skip.

        Args:
            question: The question, as it was leased.
            before: How many answers the parent has given before.

        Raises:
            UsageError: the question cannot be read.
        """
        try:
            world, rule = self._knowledge(question["world"], question["parent"])
            longest = max(question["left"]["length"], question["right"]["length"])
            query = decode(
                world, longest, question["kind"], question["maturity"], question, question.get("votes", 0)
            )
            asked = self.keys.replace(tick=torch.tensor([question["tick"]]))
        except (LookupError, TypeError, ValueError) as error:
            raise UsageError(
                f"The question cannot be read ({error!r}). Are server and command of the same version?"
            ) from None
        return CHOICE_NAMES[int(rule.answer(query, asked, torch.tensor([before]))[0])]

    def _knowledge(self, world: dict[str, Any], parent: dict[str, Any]) -> tuple[Gridworld, FallibleRule]:
        """Return the world's rules, and the rule that answers by exact values."""
        if self._world is None or self._rule is None:
            self._world = registry.make(world["name"], world["text"])
            self._rule = FallibleRule(self._world, self.spec, parent["gamma"], parent["inside"])
        return self._world, self._rule
