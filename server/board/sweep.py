"""Policies in all known states, a portion at a time: a life goes on and hears answers in between.

On a large board one state takes milliseconds, and thousands of them longer than a person waits. The policies
are copied first, so that all numbers belong to one tick.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from jaxtyping import Float
from torch import Tensor

from parenting.envs.giving_way import give_way
from parenting.server.board.states import GLYPHS_AT_ONCE, KnownStates


@dataclass
class Policy:
    """A stage's policy in the first states; `known` grows to four bytes a state."""

    parameters: Float[Tensor, "1 P"]
    known: bytearray = field(default_factory=bytearray)


class Sweep:
    """The policies of one tick by their stages, in all states that were known then."""

    def __init__(self, states: KnownStates, policies: dict[int, Policy]) -> None:
        """Compute nothing yet."""
        self.size, self.policies = len(states.cells), policies
        self.portions, self.seconds = 0, 0.0  # done so far, and how long they took
        self._states = states

    @property
    def done(self) -> bool:
        """Return whether every policy is known in every state."""
        return all(len(one.known) == 4 * self.size for one in self.policies.values())

    def go_on(self) -> None:
        """Compute a portion: batches of states until a portion's cells are through."""
        began, glyphs, world = time.monotonic(), 0, self._states.world
        for one in self.policies.values():
            while (at := len(one.known) // 4) < self.size and glyphs < GLYPHS_AT_ONCE:
                give_way()
                one.known += self._states.policy(one.parameters, at, self.size)
                glyphs += (len(one.known) // 4 - at) * world.height * world.width
        self.portions += 1
        self.seconds += time.monotonic() - began
