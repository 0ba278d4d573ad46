"""The scripted parent (Sec. 3.1.3) before a question as the API tells it: nothing else is known to it."""

from __future__ import annotations

from typing import Any

from parenting.commands.errors import UsageError
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.parents.scripted import ScriptedRule
from parenting.server.codec import CHOICE_NAMES, decode


class Judge:
    """Answers the questions of one run; what it knows of the run's world it has from the first of them."""

    def __init__(self) -> None:
        self._world: Gridworld | None = None
        self._rule: ScriptedRule | None = None

    def choice(self, question: dict[str, Any]) -> str:
        """left, right, either or neither.

        Raises:
            UsageError: the question cannot be read.
        """
        try:
            world, rule = self._knowledge(question["world"], question["parent"])
            longest = max(question["left"]["length"], question["right"]["length"])
            query = decode(world, longest, question["kind"], question["maturity"], question)
        except (LookupError, TypeError, ValueError) as error:
            raise UsageError(
                f"The question cannot be read ({error!r}). Are server and command of the same version?"
            ) from None
        return CHOICE_NAMES[int(rule.answer(query)[0])]

    def _knowledge(self, world: dict[str, Any], parent: dict[str, Any]) -> tuple[Gridworld, ScriptedRule]:
        """The world's rules, and the exact values of what can happen in it."""
        if self._world is None or self._rule is None:
            self._world = registry.make(world["name"], world["text"])
            self._rule = ScriptedRule(self._world, parent["gamma"], inside=parent["inside"])
        return self._world, self._rule
