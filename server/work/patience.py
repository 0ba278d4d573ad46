"""The wait of a worker whose store refuses: back-off with jitter, and a log that stays short."""

from __future__ import annotations

import random
import threading
import time

import structlog

from parenting.server.errors import StoreError

log = structlog.get_logger()

FIRST_WAIT, LONGEST_WAIT = 0.05, 2.0
"""Seconds before the store is asked again: doubled at each refusal, up to the longest."""
CALM_SECONDS = 5.0
"""A refusal so soon after the last one goes on with its wait: some stores refuse only large writes."""
SAY_EVERY = 1.0
"""Seconds between two lines of the log about the same refusal."""


def back_off(refusals: int) -> float:
    """Return the seconds to wait after so many refusals in a row, with jitter."""
    wait = min(LONGEST_WAIT, FIRST_WAIT * 2.0 ** min(refusals - 1, 20))
    return wait * random.uniform(0.5, 1)


class Patience:
    """The state of a store that may refuse, as one worker sees it; its threads share it.

    A refusal in the worker's own loop makes all runs wait. One in the turn of a run is a doubt: it may be
    that run's alone, such as a damaged page or a checkpoint too large for the disk, so the loop asks first.
    """

    def __init__(self) -> None:
        """The store refuses nothing yet."""
        self._lock = threading.Lock()
        self._since: float | None = None  # when the loop was refused first
        self._first: float | None = None  # when a run was
        self._until, self._ended, self._refusals = 0.0, -CALM_SECONDS, 0
        self._said: dict[str, float] = {}
        self.doubts = False

    @property
    def waits(self) -> bool:
        """Return whether the store refused last."""
        return self._since is not None

    def left(self) -> float:
        """Return the seconds until the store may be asked again."""
        return max(0.0, self._until - time.monotonic())

    def refused(self, error: StoreError) -> None:
        """Take note of a refusal: the next wait is longer."""
        with self._lock:
            now = time.monotonic()
            if self._since is None:
                self._since = now
                self._refusals = self._refusals if now - self._ended < CALM_SECONDS else 0
            self._refusals += 1
            self._until = now + back_off(self._refusals)
        self._say("store refuses; all runs wait and go on by themselves", error)

    def doubted(self, error: StoreError, run: int) -> None:
        """Take note of a refusal in the turn of one run."""
        self.doubts = True
        with self._lock:
            self._first = self._first or time.monotonic()
        self._say("store refuses; the run waits and goes on by itself", error, run=run)

    def granted(self) -> None:
        """Take note of a write of the worker's own loop that the store took."""
        self.doubts = False
        if self.waits:
            self._back()

    def dispelled(self) -> None:
        """Take note of a turn that the store let pass, of a run that it refused before."""
        if self._first is not None and not self.waits:
            self._back()

    def _back(self) -> None:
        with self._lock:
            begun = [since for since in (self._since, self._first) if since is not None]
            if not begun:
                return  # another thread has noted it
            now, began = time.monotonic(), min(begun)
            self._since, self._first, self._until = None, None, 0.0
            often, self._ended = now - self._ended < SAY_EVERY, now
        if not often:
            log.warning(f"store is back after {now - began:.1f} s")

    def _say(self, event: str, error: StoreError, **more: int) -> None:
        """Log a refusal: a line a second at most for the same one."""
        with self._lock:
            now = time.monotonic()
            if now - self._said.get(error.code, -SAY_EVERY) < SAY_EVERY:
                return
            self._said[error.code] = now
        log.warning(event, code=error.code, why=error.message, **more)
