"""The number of workers that `parenting up --workers auto` keeps: more while turns wait, fewer while idle."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # SQLAlchemy is loaded while the processes start
    from parenting.server.workers import Figures

WAIT_SECONDS = 0.1
"""A run that could tick should not wait longer."""
LASTS_SECONDS = 2.0
"""Runs have to wait for so long before another worker starts: a burst passes by itself."""
SETTLES_SECONDS = 10.0
"""Seconds from one change to the next: a worker loads torch first, and then takes its share."""
IDLE_SECONDS = 60.0
"""A worker that is not needed for so long ends."""
IDLE_SHARE = 0.5
"""The share of their cores that the others may be busy after it."""


def most_workers() -> int:
    """Return a core each, less one for the web, and at least one."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, cores - 1)


class Sizing:
    """The number of workers, as it follows from what they say of themselves."""

    def __init__(self, most: int) -> None:
        """Begin with one; `most` is how many there may be."""
        self.most, self.number = most, 1
        self._changed = -SETTLES_SECONDS
        self._waits_since: float | None = None
        self._idle_since: float | None = None

    def look(self, said: Sequence[Figures], now: float) -> int:
        """Return how many workers there should be.

        Args:
            said: What each worker said last.
            now: The time of a clock that is not set.
        """
        waits = any((one.waited or 0.0) > WAIT_SECONDS for one in said)
        busy = sum(one.busy or 0.0 for one in said)
        idle = not waits and self.number > 1 and busy <= IDLE_SHARE * (self.number - 1)
        self._waits_since = (self._waits_since if self._waits_since is not None else now) if waits else None
        self._idle_since = (self._idle_since if self._idle_since is not None else now) if idle else None
        if now - self._changed < SETTLES_SECONDS or len(said) < self.number:
            return self.number
        if self._waits_since is not None and now - self._waits_since >= LASTS_SECONDS:
            self._become(min(self.most, self.number + 1), now)
        elif self._idle_since is not None and now - self._idle_since >= IDLE_SECONDS:
            self._become(self.number - 1, now)
        return self.number

    def _become(self, number: int, now: float) -> None:
        if number != self.number:
            self.number, self._changed = number, now
            self._waits_since = self._idle_since = None
