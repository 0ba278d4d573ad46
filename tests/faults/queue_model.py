"""The queue's state machine: what its model knows of a query, and what all examples share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from parenting.server.db import Database
from parenting.server.queue.answers import Stored
from tests.faults.ledger import Told


@dataclass
class Asked:
    """A query in the model."""

    tick: int
    kind: str
    status: str = "open"
    holder: str | None = None
    until: float = 0.0
    told: Stored | None = None
    by: str = ""
    heard_at: int | None = None
    heard: int | None = None  # the number of the answer that the agent heard last
    gave: set[str] = field(default_factory=set)  # who has ever answered it
    settled: bool = False  # the agent waits for it no more

    @property
    def corrected(self) -> bool:
        """Return whether a correction of it is on its way to the agent."""
        return self.status == "applied" and self.told is not None and self.told.number != self.heard

    def free(self, client: str, now: float) -> bool:
        """Return whether no other client holds it."""
        return self.holder in (None, client) or self.until <= now


@dataclass
class Machines:
    """The database that all examples share, each with a run of its own, and everything that was told."""

    db: Database
    pass_seconds: Callable[[float], None]
    set_wall_clock: Callable[[float], None]
    told: list[Told] = field(default_factory=list)
    steps: dict[str, int] = field(default_factory=dict)
