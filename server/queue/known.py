"""The questions that a worker has stored lately: it has them in tensors, and reads none back from its row."""

from __future__ import annotations

from collections.abc import Collection

from parenting.agent.query import Query

MOST = 4
"""Questions that are kept, the newest: one of guidance is open at a time, and few recordings."""


class Known:
    """The last questions of one run, by their numbers."""

    def __init__(self) -> None:
        """None yet."""
        self._kept: dict[int, Query] = {}

    def keep(self, number: int, query: Query) -> None:
        """Keep a question that has just been stored; the oldest makes room for it."""
        self._kept[number] = query
        if len(self._kept) > MOST:
            del self._kept[next(iter(self._kept))]

    def forget(self, number: int) -> Query | None:
        """Return a question that is kept, and keep it no longer; None if it is not."""
        return self._kept.pop(number, None)

    def numbers(self) -> Collection[int]:
        """Return the numbers of the questions that are kept."""
        return self._kept.keys()
