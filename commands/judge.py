"""The scripted parent (Sec. 3.1.3) of a question in the API's words, which are all that it knows."""

from __future__ import annotations

from typing import Any

from parenting.commands.errors import UsageError
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.parents.scripted import ScriptedRule
from parenting.server.codec import CHOICE_NAMES, decode


class Judge:
    """The judge of one run's questions. It makes the run's world from the first of them."""

    def __init__(self) -> None:
        self._world: Gridworld | None = None
        self._rule: ScriptedRule | None = None

    def choice(self, question: dict[str, Any]) -> str:
        """Return left, right, either or neither.

        Raises:
            UsageError: the question cannot be read.
        """
        try:
            world, rule = self._knowledge(question["world"], question["parent"])
            longest = max(question["left"]["length"], question["right"]["length"])
            query = decode(
                world, longest, question["kind"], question["maturity"], question, question.get("votes", 0)
            )
        except (LookupError, TypeError, ValueError) as error:
            raise UsageError(
                f"The question cannot be read ({error!r}). Are server and command of the same version?"
            ) from None
        return CHOICE_NAMES[int(rule.answer(query)[0])]

    def _knowledge(self, world: dict[str, Any], parent: dict[str, Any]) -> tuple[Gridworld, ScriptedRule]:
        """Return the world's rules, and the rule that answers by exact values."""
        if self._world is None or self._rule is None:
            self._world = registry.make(world["name"], world["text"])
            self._rule = ScriptedRule(self._world, parent["gamma"], inside=parent["inside"])
        return self._world, self._rule
