"""The times at which turns of runs are due, and the time that a turn which is due waits until it begins."""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Iterable, Mapping, Sequence

from parenting.server.queue.worker_side import Watch

NOW, AT_NEWS, AT_LEISURE = 0.0, math.inf, -1.0
"""When the next turn of a run is due: at once, when something is new for it, or in `WRITE_SECONDS` if nobody
waits for another one, as it only writes down what has happened."""
WRITE_SECONDS = 2.0
"""Seconds until a turn at leisure: a person who answers before has one row for both answers."""
OVERDUE_SECONDS = 1.0
"""A turn that is due for so long is overdue: not all others for which a person waits go before it."""
LEISURE_SECONDS = 5.0
"""Seconds after which a turn at leisure is due like any other."""


class Schedule:
    """The turns of a worker's runs to come. A run that waits for its parent has none."""

    def __init__(self) -> None:
        """Nothing is due."""
        self.seen: dict[int, Watch] = {}
        self._given: dict[int, Watch] = {}
        self._at: dict[int, float] = {}  # of runs that do not wait for news
        self._resting: set[int] = set()
        self._leisurely: set[int] = set()
        self._since: dict[int, float] = {}
        self._longest = 0.0
        self._urgent: set[int] = set()

    def news(self, found: Mapping[int, Watch]) -> None:
        """Take note of what is new: a run is due if anything of it has changed."""
        for run_id, seen in found.items():
            if self.seen.get(run_id) != seen:
                self.seen[run_id] = seen
                if run_id not in self._leisurely or not seen.at_leisure:
                    self._set(run_id, NOW)

    def keep(self, run_ids: Collection[int]) -> None:
        """Forget all other runs."""
        for run_id in self.seen.keys() - run_ids:
            for table in (self.seen, self._at, self._since):
                table.pop(run_id, None)
            self._resting.discard(run_id)
            self._leisurely.discard(run_id)

    def hurry(self, run_ids: Iterable[int]) -> None:
        """Let these runs have a turn at once."""
        for run_id in run_ids:
            if run_id in self.seen:
                self._set(run_id, NOW)

    def end_leisure(self) -> None:
        """Have the turns at leisure due like any other: somebody waits for what they hold."""
        self.hurry(list(self._leisurely))

    def due(self) -> Sequence[int]:
        """Return the runs whose turn is due: those for which a person waits, then the longest due.

        The one of these that has been due for longest is the second of all if it is overdue: a round that has
        no time for all runs has time for two.
        """
        now = time.monotonic()
        due = [run_id for run_id, at in self._at.items() if at <= now]
        due.sort(key=lambda run_id: (not self.seen[run_id].urgent, self._since.get(run_id, now)))
        urgent = sum(self.seen[run_id].urgent for run_id in due)
        self._urgent = set(due[:urgent]) - self._given.keys()
        if 1 < urgent < len(due) and self._waits(due[urgent], now) > OVERDUE_SECONDS:
            due.insert(1, due.pop(urgent))
        return due

    def begin(self, run_id: int) -> Watch:
        """Take note that a run's turn begins; return what was seen of the run."""
        self._longest = max(self._longest, self._waits(run_id, time.monotonic()))
        self._since.pop(run_id, None)
        self._urgent.discard(run_id)
        self._leisurely.discard(run_id)
        self._given[run_id] = self.seen[run_id]
        return self.seen[run_id]

    def people_wait(self) -> bool:
        """Return whether a person waits for a turn that was due at the last `due` and has not begun."""
        return bool(self._urgent)

    def ended(self, turns: Mapping[int, float]) -> bool:
        """Take note of turns that have ended, and return whether another one of such a run is due at once.

        Args:
            turns: When the next turn of each run is due.
        """
        at_once = False
        for run_id, due in turns.items():
            given = self._given.pop(run_id)
            if run_id in self.seen:
                seen = self.seen[run_id]
                due = due if seen is given or (due == AT_LEISURE and seen.at_leisure) else NOW
                self._since.pop(run_id, None)  # it has not waited while its own turn went on
                self._set(run_id, due)
                at_once |= due == NOW
        return at_once

    def soonest(self, most: float) -> float:
        """Return the seconds until the next turn is due that is not due yet, at most so many."""
        now = time.monotonic()
        return min([most, *(at - now for at in self._at.values() if at > now)])

    def busy_first(self, run_ids: Collection[int]) -> Sequence[int]:
        """Return runs by the time of their next turn."""
        return sorted(run_ids, key=lambda run_id: (max(NOW, self._at.get(run_id, AT_NEWS)), run_id))

    def at_rest(self) -> Sequence[int]:
        """Return the runs that wait for news."""
        return list(self._resting)

    def not_due(self) -> Sequence[int]:
        """Return the runs of which nothing is new: they wait for news, or for a time to come."""
        now = time.monotonic()
        return [*self._resting, *(run_id for run_id, at in self._at.items() if at > now)]

    def waited(self) -> float:
        """Return the longest time that a turn which was due has waited since the last call."""
        now, longest = time.monotonic(), self._longest
        self._longest = 0.0
        waits = (self._waits(run_id, now) for run_id in list(self._since) if run_id not in self._given)
        return max([longest, *waits])

    def _waits(self, run_id: int, now: float) -> float:
        return max(0.0, now - self._since.get(run_id, now))

    def _set(self, run_id: int, at: float) -> None:
        self._resting.discard(run_id)
        self._leisurely.discard(run_id)
        if at == AT_NEWS:
            self._resting.add(run_id)
            self._at.pop(run_id, None)
            self._since.pop(run_id, None)
            return
        now, before = time.monotonic(), self._since.get(run_id, math.inf)
        self._at[run_id], self._since[run_id] = at, max(at, min(before, now))
        if at == AT_LEISURE:
            self._leisurely.add(run_id)
            self._at[run_id], self._since[run_id] = now + WRITE_SECONDS, now + LEISURE_SECONDS
