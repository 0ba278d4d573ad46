"""Turns of runs: a quick one is waited for, a long one goes on beside the others.

Threads suffice: torch works without Python's lock, and a step on a large network spends its time there. All
turns of a run come one after another, each with the state that the one before left, so bits do not depend on
what goes on beside them. Steps on small networks take the lock again and again, so that two quick turns
beside each other take several times as long as one after the other: long ones alone go on beside others. Long
turns of small networks stand back while a person waits for a quick one (`server.work.courtesy`).
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass

import torch

from parenting.server.work.courtesy import Courtesy

BESIDE_SECONDS = 0.15
"""A turn that takes longer no longer holds up the other runs."""
LONG_SECONDS = 0.1
"""A run whose last turn took the processor for longer is not waited for at all. The time that a turn waited
for the lock, the store or the processor does not count: beside others every turn would soon be a long one."""
HUNG_SECONDS = 300.0
"""A turn that takes longer counts as hung: the run's claim is not renewed, and another worker may take it."""
LONG_AT_ONCE = max(2, os.cpu_count() or 1)
"""Long turns at once. More would only take the processor from quick ones, and one alone may hang."""
SLOW_SECONDS = 1.0
"""A run whose last turn took the processor for longer is a slow one: its person waits anyway, and others
should not."""
QUICK_AT_ONCE = 2 * LONG_AT_ONCE
"""Turns at once, long or not: some that were quick before turn out to be long."""
SLOW_AT_ONCE = QUICK_AT_ONCE + 4
"""Turns at once, those of slow runs included for which a person waits."""
URGENT_AT_ONCE = SLOW_AT_ONCE + 4
"""Turns at once, those included for which a person waits: these find a thread whatever the others do."""

Turn = Callable[[], float]
"""It returns the time of `time.monotonic` from which the run's next turn is due."""


@dataclass(frozen=True)
class Ended:
    """A turn that has ended."""

    due: float
    """When the run's next turn is due."""
    worked: float
    """Its seconds of the processor."""


@dataclass(frozen=True)
class Working:
    """A turn that has begun."""

    began: float
    done: Future[Ended]


class Turns:
    """The turns of a worker's runs, at most one of each run at a time."""

    def __init__(self, wake: Callable[[], None], beside_after: float | None = BESIDE_SECONDS) -> None:
        """Nothing has begun.

        Args:
            wake: Called in another thread when a long turn has ended.
            beside_after: Seconds for which a turn is waited for; None waits for each to its end.
        """
        self._wake, self.beside_after, self.courtesy = wake, beside_after, Courtesy()
        self._working: dict[int, Working] = {}
        self._long: set[int] = set()
        self._slow: set[int] = set()
        self._pool = ThreadPoolExecutor(
            URGENT_AT_ONCE, "turn", initializer=torch.set_num_threads, initargs=(1,)
        )

    def may_begin(self, run_id: int, new: bool, urgent: bool = False) -> bool:
        """Return whether a turn of a run may begin now.

        Args:
            run_id: The run.
            new: It has no life in memory, so that this turn counts as long.
            urgent: A person waits for it, so that threads are kept for it, fewer if the last took seconds.
        """
        if run_id in self._working:
            return False
        going_on = len(self.working())
        if urgent:
            return going_on < (SLOW_AT_ONCE if run_id in self._slow else URGENT_AT_ONCE)
        return going_on < (LONG_AT_ONCE if new or run_id in self._long else QUICK_AT_ONCE)

    def begin(self, run_id: int, turn: Turn, urgent: bool = False) -> None:
        """Begin a turn, and wait for its end unless it takes long, or the run's last one did.

        Args:
            run_id: The run.
            turn: Its turn.
            urgent: A person waits for it, so that long turns stand back, unless its own last took seconds.
        """
        hurried = urgent and run_id not in self._slow
        begun = Working(time.monotonic(), self._pool.submit(self._courteous, run_id, turn, hurried))
        self._working[run_id] = begun
        quick = run_id not in self._long
        if self.beside_after is None or quick:
            wait([begun.done], self.beside_after)
        if not begun.done.done():
            begun.done.add_done_callback(lambda _: self._wake())

    def _courteous(self, run_id: int, turn: Turn, hurried: bool) -> Ended:
        with self.courtesy.turn(run_id, hurried):
            began = time.thread_time()
            return Ended(turn(), time.thread_time() - began)

    def ended(self) -> dict[int, float]:
        """Return when the next turn is due, for each run whose turn has ended since the last call.

        Raises:
            Exception: what a turn raised.
        """
        over = {run_id: begun for run_id, begun in self._working.items() if begun.done.done()}
        for run_id in over:
            del self._working[run_id]
        ended = {run_id: begun.done.result() for run_id, begun in over.items()}
        for run_id, turn in ended.items():
            (self._long.add if turn.worked > LONG_SECONDS else self._long.discard)(run_id)
            (self._slow.add if turn.worked > SLOW_SECONDS else self._slow.discard)(run_id)
        return {run_id: turn.due for run_id, turn in ended.items()}

    def working(self, longer_than: float = -math.inf) -> set[int]:
        """Return the runs whose turn has begun and not ended, for longer than some seconds."""
        since = time.monotonic() - longer_than
        going_on = list(self._working.items())  # signs of life look from a thread of their own
        return {run_id for run_id, turn in going_on if turn.began < since and not turn.done.done()}

    def close(self, seconds: float) -> None:
        """Wait for the turns that have begun, at most for some seconds."""
        wait([begun.done for begun in self._working.values()], seconds)
        self._pool.shutdown(wait=False, cancel_futures=True)
