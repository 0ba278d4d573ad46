"""The load of a worker process, as it tells with its signs of life."""

from __future__ import annotations

import os
import resource
import sys
import time
from pathlib import Path

from parenting.server.workers import Figures

STATM = Path("/proc/self/statm")


class Load:
    """The processor time that this process takes, between two looks."""

    def __init__(self) -> None:
        """Begin to count."""
        self._at, self._spent = time.monotonic(), time.process_time()

    def figures(self, runs: int, lives: int, waited: float) -> Figures:
        """Return what a worker says of itself.

        Args:
            runs: The runs that it raises.
            lives: Those of them whose life is in memory.
            waited: Seconds that a turn which was due has waited, at the most.
        """
        now, spent = time.monotonic(), time.process_time()
        busy = (spent - self._spent) / max(now - self._at, 1e-3)
        self._at, self._spent = now, spent
        return Figures(runs, lives, busy, memory(), waited)


def memory() -> int:
    """Return the resident bytes of this process; where the system does not tell, the most that it had."""
    try:
        return int(STATM.read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak if sys.platform == "darwin" else 1024 * peak
