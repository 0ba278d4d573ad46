"""The seam between agent and parent (Sec. 2.1, 2.2): three verbs, and nothing else that the agent knows.

parents.scripted.ScriptedParent         answers in tensors, one tick later (Eq. 7, 8)
server.queue.queue_parent.QueueParent   answers through the database
parents.replay.ReplayParent             gives a recorded session back
library.parent.Parent                   a base class for parents of one's own, in plain Python
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from torch import Tensor

from parenting.agent.amendment import TickEvent
from parenting.agent.query import Answer, Query
from parenting.agent.state import AgentState


class Parent(Protocol):
    """A mailbox outside the agent. `agent.parenting.tick` calls its verbs in this order, once a tick."""

    def events(self, state: AgentState) -> Sequence[TickEvent]:
        """Return what applies before this tick, in order: the operator's events, and corrected answers."""
        ...

    def take(self, state: AgentState) -> Answer:
        """Return at most one answer for each trial, to be heard in this tick; silence is an answer.

        Never wait: an agent that has asked for guidance pauses by itself until an answer comes.
        """
        ...

    def post(self, query: Query) -> None:
        """Receive what the agent asks in this tick: N trials, at most one question each."""
        ...


class BatchParent(Parent, Protocol):
    """A parent of a batch from which trials leave as they finish."""

    def pick(self, index: Tensor) -> None:
        """Go on with the trials of `index` alone, in that order."""
        ...
