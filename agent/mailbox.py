"""The seam between agent and parent: a mailbox with two verbs, and the operator's events."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from parenting.agent.events import Event
from parenting.agent.query import Answer, Query
from parenting.agent.state import AgentState


class Mailbox(Protocol):
    """All that the agent knows of its parent. `parents.parent` says who stands behind it."""

    def take(self, state: AgentState) -> Answer:
        """At most one answer a trial, for this tick; "none" is an answer. Never waits."""
        ...

    def post(self, query: Query) -> None:
        """Take what the agent asks in this tick."""
        ...

    def events(self, state: AgentState) -> Sequence[Event]:
        """The operator's events that apply before this tick: mature now, end the episode, a changed p."""
        ...
