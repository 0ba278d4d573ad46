"""The feed of trackers: a thread with a bounded queue, so that no tracker stops or slows a run.

Whoever feeds it never waits. Where a tracker is slower than the metrics, or hangs, rows beyond `MOST_ROWS`
are dropped and counted. What a tracker raises is counted, too. The log says both, at first and at the end.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from functools import partial

import structlog

from parenting.server.trackers.tracker import TrackedRun, Tracker, Values

log = structlog.get_logger()

MOST_ROWS = 1000
"""Rows of metrics that wait for a tracker at most."""


class Feed:
    """One tracker, and what it is still to be told."""

    def __init__(self, tracker: Tracker, name: str = "") -> None:
        """Begin a thread that tells the tracker; it does not keep the process from ending."""
        self.tracker, self.name = tracker, name or type(tracker).__name__
        self.dropped = self.failed = 0
        self._steps: dict[str, int] = {}
        self._waiting: deque[tuple[bool, Callable[[], None]]] = deque()
        self._rows, self._busy, self._closed = 0, False, False
        self._news = threading.Condition()
        threading.Thread(target=self._tell, name=f"tracker {self.name}", daemon=True).start()

    def begin(self, run: TrackedRun, after: int = -1) -> None:
        """Tell that a run begins, whose steps up to `after` were told before."""
        with self._news:
            self._steps[run.id] = max(after, self._steps.get(run.id, -1))
        self._put(False, partial(self.tracker.begin, run))

    def log(self, run: str, step: int, values: Values) -> None:
        """Tell metrics. A step that is not beyond the last one, as of a replayed tick, is left out."""
        with self._news:
            if step <= self._steps.get(run, -1):
                return
            self._steps[run] = step
            full = self._rows >= MOST_ROWS
            self.dropped += full
            first = full and self.dropped == 1
        if first:
            log.warning("a tracker is too slow; rows of metrics are dropped", tracker=self.name)
        if not full:
            self._put(True, partial(self.tracker.log, run, step, dict(values)))

    def end(self, run: str, reason: str) -> None:
        """Tell that a run has ended, or goes on elsewhere."""
        self._put(False, partial(self.tracker.end, run, reason))

    def drained(self, seconds: float) -> bool:
        """Wait at most so long until everything is told; return whether it is."""
        with self._news:
            return self._news.wait_for(lambda: not self._waiting and not self._busy, seconds)

    def close(self, seconds: float) -> bool:
        """Wait at most so long until everything is told; return whether it is. Say what was lost."""
        with self._news:
            self._closed = True
            self._news.notify_all()
            done = self._news.wait_for(lambda: not self._waiting and not self._busy, seconds)
            left = self._rows
        if self.dropped or self.failed or not done:
            log.warning(
                "a tracker was not told everything",
                tracker=self.name,
                dropped=self.dropped + left,
                failed=self.failed,
            )
        return done

    def _put(self, is_row: bool, call: Callable[[], None]) -> None:
        with self._news:
            self._waiting.append((is_row, call))
            self._rows += is_row
            self._news.notify_all()

    def _tell(self) -> None:
        while True:
            with self._news:
                self._busy = False
                self._news.notify_all()
                self._news.wait_for(lambda: self._waiting or self._closed)
                if not self._waiting:
                    return
                is_row, call = self._waiting.popleft()
                self._rows -= is_row
                self._busy = True
            try:
                call()
            except BaseException as error:  # whatever it raises, even SystemExit, the run goes on
                self.failed += 1
                if self.failed == 1:
                    log.warning("a tracker failed; the run goes on", tracker=self.name, error=repr(error))


class Feeds:
    """All trackers of a worker or of a training."""

    def __init__(self, feeds: list[Feed]) -> None:
        self.feeds = feeds

    def begin(self, run: TrackedRun, after: int = -1) -> None:
        """Tell every tracker that a run begins."""
        for feed in self.feeds:
            feed.begin(run, after)

    def log(self, run: str, step: int, values: Values) -> None:
        """Tell every tracker metrics."""
        for feed in self.feeds:
            feed.log(run, step, values)

    def end(self, run: str, reason: str) -> None:
        """Tell every tracker that a run has ended."""
        for feed in self.feeds:
            feed.end(run, reason)

    def close(self, seconds: float) -> None:
        """Wait until everything is told, at most so long for each tracker."""
        for feed in self.feeds:
            feed.close(seconds)
