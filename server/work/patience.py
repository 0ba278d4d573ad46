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


class Patience:
    """The state of a store that may refuse, as one worker sees it; its threads share it."""

    def __init__(self) -> None:
        """The store refuses nothing yet."""
        self._lock = threading.Lock()
        self._since: float | None = None
        self._wait = self._until = 0.0
        self._ended = -CALM_SECONDS
        self._said: dict[str, float] = {}

    @property
    def waits(self) -> bool:
        """Return whether the store refused last."""
        return self._since is not None

    def left(self) -> float:
        """Return the seconds until the store may be asked again."""
        return max(0.0, self._until - time.monotonic())

    def refused(self, error: StoreError) -> None:
        """Take note of a refusal: the next wait is longer, and the log has a line a second at most."""
        with self._lock:
            now = time.monotonic()
            if self._since is None:
                self._since = now
                self._wait = self._wait if now - self._ended < CALM_SECONDS else 0.0
            if now >= self._until:  # refusals during a wait are of the same try
                self._wait = min(LONGEST_WAIT, 2 * self._wait or FIRST_WAIT)
                self._until = now + self._wait * random.uniform(0.5, 1)
            if now - self._said.get(error.code, -SAY_EVERY) < SAY_EVERY:
                return
            self._said[error.code] = now
        log.warning(
            "store refuses; all runs wait and go on by themselves", code=error.code, why=error.message
        )

    def granted(self) -> None:
        """Take note of a write that the store took."""
        with self._lock:
            if self._since is None:
                return
            now = time.monotonic()
            seconds, self._since, self._until = now - self._since, None, 0.0
            often, self._ended = now - self._ended < SAY_EVERY, now
        if not often:
            log.warning(f"store is back after {seconds:.1f} s")
