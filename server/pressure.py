"""The pressure on a worker: what its other runs ask of it while one has its turn."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

PRESSED_SECONDS = 1.0
"""Pressure lasts so long after people waited: in a crowd the next ones come at once."""
PUT_OFF_SECONDS = 5.0
"""A turn that comes so long after the last such work does it even while people wait for other runs."""


@dataclass
class Pressure:
    """The state that the main thread of a worker writes, and turns in other threads read."""

    waiting: bool = False
    """People wait for turns of other runs, or did so just before."""
    runs: int = 1
    """Runs with a life in memory."""
    _until: float = -math.inf

    def press(self, people_wait: bool, runs: int) -> None:
        """Take note of whether people wait for other runs, and of how many runs there are."""
        now = time.monotonic()
        if people_wait:
            self._until = now + PRESSED_SECONDS
        self.waiting, self.runs = now < self._until, runs


ALONE = Pressure()
"""Of a run that is raised without a worker."""


class PutOff:
    """The work of one run for which nobody waits: metrics, snapshots, reasons, checkpoints.

    It is done right after the question while nobody waits for another run. Where people do, it is left for a
    turn of its own, which comes when they are served, or for the next turn of the run.
    """

    def __init__(self, pressure: Pressure) -> None:
        """Nothing is put off."""
        self._pressure, self._done_at = pressure, time.monotonic()

    def may_wait(self) -> bool:
        """Return whether to leave it for later. What is not left counts as done."""
        now = time.monotonic()
        if self._pressure.waiting and now - self._done_at < PUT_OFF_SECONDS:
            return True
        self._done_at = now
        return False
