"""The pressure on a worker: what its other runs ask of it while one has its turn."""

from __future__ import annotations

import time
from dataclasses import dataclass

PUT_OFF_SECONDS = 5.0
"""A turn that comes so long after the last such work does it even while people wait for other runs."""


@dataclass
class Pressure:
    """The state that the main thread of a worker writes, and turns in other threads read."""

    waiting: bool = False
    """People wait for turns of other runs."""
    runs: int = 1
    """Runs with a life in memory."""


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
