"""ReplayParent: gives a recorded session back, tick by tick, and holds the agent to what it asked then."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch

from parenting.agent import amendment
from parenting.agent.amendment import Correction, TickEvent
from parenting.agent.events import Event
from parenting.agent.query import Answer, Query, QueryKind
from parenting.agent.state import AgentState


class Moment(NamedTuple):
    """The record of one tick: the operator's events before it, the answer heard, and the query asked."""

    events: Sequence[Event]
    answer: Answer
    asked: Query
    correction: Correction | None = None


Session = Callable[[int], Moment]
"""The record of a session: the moment of each tick, from tick 1 on."""


class ReplayMismatchError(Exception):
    """At this tick the agent asks something else than was recorded."""

    def __init__(self, tick: int, recorded: Query, asked: Query) -> None:
        super().__init__(f"At tick {tick} the agent asks something else than was recorded.")
        self.tick, self.recorded, self.asked = tick, recorded, asked


class ReplayParent:
    """Answers and events come from a record, each at its tick; nobody is asked again."""

    def __init__(self, session: Session) -> None:
        """A mailbox for the agents of the session: the same world, config and seeds, from tick 0 on."""
        self.session = session
        self.tick = 0
        self._moment: Moment  # of this tick; `events` comes first in every tick

    def events(self, state: AgentState) -> Sequence[TickEvent]:
        """The events and the correction that were applied before this tick."""
        self.tick = int(state.keys.tick[0]) + 1
        self._moment = self.session(self.tick)
        if self._moment.correction is None:
            return self._moment.events
        event, heard = amendment.take(state, self._moment.events, self._moment.correction)
        if heard is not None:
            self._moment = self._moment._replace(answer=heard)
        return [*self._moment.events, event]

    def take(self, state: AgentState) -> Answer:
        """The answer that was heard in this tick."""
        return self._moment.answer

    def post(self, query: Query) -> None:
        """Hold the query against the record.

        Raises:
            ReplayMismatchError: it is another one.
        """
        if not same(self._moment.asked, query):
            raise ReplayMismatchError(self.tick, self._moment.asked, query)


def same(one: Query, other: Query) -> bool:
    """Return whether both ask the same in every trial; trials that ask nothing are equal."""
    if not torch.equal(one.kind, other.kind):
        return False
    asking = one.kind != QueryKind.NONE
    theirs = other.pick(asking).tensors()
    return all(torch.equal(part, theirs[name]) for name, part in one.pick(asking).tensors().items())
