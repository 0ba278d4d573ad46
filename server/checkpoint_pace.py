"""The times of checkpoints: often enough that a restart repeats little, seldom enough that they cost little.

A restart repeats the ticks since the last checkpoint, so that what counts is the work in them, not the time
that an agent waited for its parent. A checkpoint is due once the ticks since the last one took
1 / `CHECKPOINT_SHARE` times as long as that one did.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from parenting.server.pressure import ALONE, Pressure

CHECKPOINT_SECONDS, LONGEST_CHECKPOINT_SECONDS = 2.0, 120.0
"""Seconds between two checkpoints: at least, and at most on account of their size."""
CHECKPOINT_SHARE, CHECKPOINT_SPEED = 0.05, 1e6
"""The share of a run's time that checkpoints take at most, and their bytes a second."""
LARGE_SECONDS = 5.0
"""Checkpoints that are written at longer intervals count as large: the log tells of them."""
QUIET_SECONDS, QUIET_EACH, LONGEST_QUIET_SECONDS = 10.0, 1.0, 30.0
"""A small one is written after so long in any case, if a tick has passed; in a worker of many runs after so
long for each of them, so that those of up to thirty runs come once a second."""


class CheckpointPace:
    """The pace of one run's checkpoints."""

    def __init__(self, clock: Callable[[], float] = time.monotonic, pressure: Pressure = ALONE) -> None:
        """Begin now, with nothing to save."""
        self._clock, self._saved_at, self._pressure = clock, clock(), pressure
        self.every = CHECKPOINT_SECONDS
        self.work, self._enough = 0.0, 0.0  # seconds that ticks took since then, and that make one due

    @property
    def large(self) -> bool:
        """Return whether the last checkpoint was a large one."""
        return self.every >= LARGE_SECONDS

    @property
    def next(self) -> float:
        """Return when the next checkpoint is due, if no further tick passes; `inf` for never."""
        if self.work >= (self.every if self.large else self._enough):
            return self._saved_at + self.every
        quiet = min(max(QUIET_SECONDS, QUIET_EACH * self._pressure.runs), LONGEST_QUIET_SECONDS)
        return math.inf if self.large else self._saved_at + max(self.every, quiet)

    @property
    def due(self) -> bool:
        """Return whether a checkpoint should be written now, if a tick has passed."""
        return self._clock() >= self.next

    def saved(self, took: float, size: int) -> None:
        """Go on after a checkpoint that took so many seconds and has so many bytes."""
        self._saved_at, self.work, self._enough = self._clock(), 0.0, took / CHECKPOINT_SHARE
        by_size = min(max(CHECKPOINT_SECONDS, size / CHECKPOINT_SPEED), LONGEST_CHECKPOINT_SECONDS)
        self.every = max(by_size, self._enough)
