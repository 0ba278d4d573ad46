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


@dataclass
class Machines:
    """The database that all examples share, each with a run of its own, and everything that was told."""

    db: Database
    pass_seconds: Callable[[float], None]
    set_wall_clock: Callable[[float], None]
    told: list[Told] = field(default_factory=list)
    steps: dict[str, int] = field(default_factory=dict)
