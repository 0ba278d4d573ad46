"""The time that a caller still has: whatever waits for the store waits no longer than that.

A request of the web waits first for its turn, then for the lock of this process, then for the lock of the
file. Each of these waits is bounded, and their sum is bounded too: all of them draw on one deadline.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_DEADLINE: ContextVar[float] = ContextVar("deadline", default=float("inf"))


@contextmanager
def patience(seconds: float) -> Iterator[None]:
    """Bound the waits for the store within this block: they end `seconds` from now at the latest.

    An outer block that ends sooner is not extended. Threads that a task awaits inherit its deadline.
    """
    token = _DEADLINE.set(min(_DEADLINE.get(), time.monotonic() + seconds))
    try:
        yield
    finally:
        _DEADLINE.reset(token)


def remaining(most: float) -> float:
    """Return the seconds that may still be waited, at least 0 and at most `most`."""
    return max(0.0, min(most, _DEADLINE.get() - time.monotonic()))
