"""Giving way: points within long work at which others, for whom a person waits, may go first.

Whoever raises several agents in one process sets what happens at these points in its thread (the worker in
`server.work.courtesy`); left alone, nothing happens. It is told nothing and returns nothing, so no bit
depends on it.
"""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar

WAY: ContextVar[Callable[[], None] | None] = ContextVar("way", default=None)
"""It returns when the work of this thread may go on; None lets it go on at once."""


def give_way() -> None:
    """Let others go first, if somebody in this thread has said how."""
    if (until_free := WAY.get()) is not None:
        until_free()
