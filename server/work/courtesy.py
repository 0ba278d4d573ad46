"""Courtesy: while a person waits for a quick run, long work in the same process stands back.

Threads of one process share Python's lock, and a tick of a small agent takes it some hundred times. So beside
two ticks of a thousand gradient steps each it would take several times as long. Long work therefore gives way
between two gradient steps (`envs.giving_way`) while the turn of such a run goes on. Where it computes in
Python itself, the lock changes hands more often meanwhile.

Nobody starves: a run counts as quick for a moment only, each point holds long work up for a few hundredths of
a second at most, and all points of a turn together for no longer than it has worked.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from parenting.envs.giving_way import WAY

SWITCH_SECONDS = 1e-4
"""A thread that waits for Python's lock gets it after so long while a person waits."""
QUICK_SECONDS = 0.5
"""A turn that has taken so long is not a quick one: others do not stand back for it any more."""
LONGEST_WAIT = 0.05
"""Seconds for which one point holds long work up, at the most."""
LONG_SECONDS = 0.05
"""Work that has taken so long is long work."""


@dataclass
class Stood:
    """The times of a turn: when it began, and the seconds for which it stood back."""

    began: float
    waited: float = 0.0


class Courtesy:
    """The turns in this process for which a person waits, and the wait of all others for them."""

    def __init__(self) -> None:
        """Nobody hurries."""
        self._changed = threading.Condition()
        self._hurried: dict[int, float] = {}
        self._usual = sys.getswitchinterval()

    @contextmanager
    def turn(self, run_id: int | None, hurried: bool) -> Iterator[None]:
        """Let a turn of a run go first if it is `hurried`, and else give way, until the block ends.

        Args:
            run_id: The run; None for work of no run's turn.
            hurried: A person waits for it, and it is likely to be quick.
        """
        stood = Stood(time.monotonic())
        token = WAY.set(lambda: self._until_free(run_id, stood))
        if run_id is not None and hurried:
            self.hurries(run_id)
        try:
            yield
        finally:
            WAY.reset(token)
            if run_id is not None and hurried:
                self.ended(run_id)

    def hurries(self, run_id: int) -> None:
        """Let others stand back for a run from now on."""
        with self._changed:
            if not self._hurried:
                self._usual = sys.getswitchinterval()
            self._hurried = {**self._hurried, run_id: time.monotonic()}
            sys.setswitchinterval(min(SWITCH_SECONDS, self._usual))

    def ended(self, run_id: int) -> None:
        """Let them go on, as far as this run is concerned."""
        with self._changed:
            self._hurried = {one: at for one, at in self._hurried.items() if one != run_id}
            if not self._hurried:
                sys.setswitchinterval(self._usual)
            self._changed.notify_all()

    def _until_free(self, run_id: int | None, stood: Stood) -> None:
        """Wait while another run hurries and this one does not."""
        if not self._hurried:  # the usual case, without the lock
            return
        now = time.monotonic()
        worked = now - stood.began - stood.waited
        if worked < LONG_SECONDS or stood.waited > worked:
            return
        with self._changed:
            self._changed.wait_for(lambda: not self._stands_back(run_id), LONGEST_WAIT)
        stood.waited += time.monotonic() - now

    def _stands_back(self, run_id: int | None) -> bool:
        since = time.monotonic() - QUICK_SECONDS
        quick = {one for one, began in self._hurried.items() if began > since}
        return bool(quick) and run_id not in quick
