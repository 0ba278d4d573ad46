"""A scripted parent of a question in the API's words, which are all that it knows (Sec. 3.1.3, and ours).

Parents who do not err share what they know of a world, and the answers that they have found: in a crowd the
same moves are asked about again and again.
"""

from __future__ import annotations

import hashlib
import json
from functools import lru_cache
from typing import Any

import torch

from parenting.agent.config import GardenParent
from parenting.agent.query import Query
from parenting.commands.errors import UsageError
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import keys
from parenting.parents.fallible import FallibleRule
from parenting.parents.grammar import SCRIPTED, ParentSpec
from parenting.server.codec import CHOICE_NAMES, decode

SHOWN = ("kind", "maturity", "votes", "left", "right")
"""The parts of a question that decide how a parent who does not err answers it."""
MOST_FOUND = 10_000
"""Answers that are kept for each world."""


class Knowledge:
    """A world, a parent's rule in it, and the answers that this rule has given."""

    def __init__(
        self, name: str, text: str | None, gamma: float, inside: GardenParent, spec: ParentSpec
    ) -> None:
        """Compute the exact values of the world."""
        self.world = registry.make(name, text)
        self.rule = FallibleRule(self.world, spec, gamma, inside)
        self.found: dict[bytes, str] = {}  # by a digest of what was shown

    def keep(self, shown: bytes, choice: str) -> None:
        """Keep an answer; a full memory is emptied first."""
        if len(self.found) >= MOST_FOUND:
            self.found.clear()
        self.found[shown] = choice


shared_knowledge = lru_cache(maxsize=32)(Knowledge)


class Judge:
    """The judge of one run's questions. It makes the run's world from the first of them."""

    def __init__(self, spec: ParentSpec = SCRIPTED, seed: int = 0) -> None:
        """Judge as a parent does whose errors are drawn by the run's seed."""
        self.spec, self.keys = spec, keys(seed, 1)
        self._own: Knowledge | None = None  # of a parent who errs

    def choice(self, question: dict[str, Any], before: int = 0) -> str:
        """Return left, right, either, neither or skip.

        Args:
            question: The question, as it was leased.
            before: How many answers the parent has given before.

        Raises:
            UsageError: the question cannot be read.
        """
        try:
            known = self._knowledge(question["world"], question["parent"])
            shown = b"" if self.spec.errs else _digest(question)
            if shown in known.found:
                return known.found[shown]
            query = _decoded(known.world, question)
            asked = self.keys.replace(tick=torch.tensor([question["tick"]]))
        except (LookupError, TypeError, ValueError) as error:
            raise UsageError(
                f"The question cannot be read ({error!r}). Are server and command of the same version?"
            ) from None
        choice = CHOICE_NAMES[int(known.rule.answer(query, asked, torch.tensor([before]))[0])]
        if shown:
            known.keep(shown, choice)
        return choice

    def _knowledge(self, world: dict[str, Any], parent: dict[str, Any]) -> Knowledge:
        """Return what this parent knows of a world."""
        told = (world["name"], world["text"], parent["gamma"], parent["inside"], self.spec)
        if not self.spec.errs:
            return shared_knowledge(*told)
        if self._own is None:
            self._own = Knowledge(*told)
        return self._own


def _digest(question: dict[str, Any]) -> bytes:
    shown = json.dumps([question.get(name) for name in SHOWN])
    return hashlib.blake2b(shown.encode(), digest_size=16).digest()


def _decoded(world: Gridworld, question: dict[str, Any]) -> Query:
    longest = max(question["left"]["length"], question["right"]["length"])
    votes = question.get("votes", 0)
    return decode(world, longest, question["kind"], question["maturity"], question, votes)
