"""An event that a signal handler may set.

`threading.Event` is not made for that: a handler runs in the main thread, between two steps of whatever that
thread does. If that is `wait` or `set` of the same event, `set` waits for a lock that its own thread holds,
and the process never ends.
"""

from __future__ import annotations

import queue


class SignalEvent:
    """An event, not set at first. Any number of threads may wait for it, and a signal handler may set it."""

    def __init__(self) -> None:
        self._set = False
        # Its `put` may interrupt its `get` and `put` in the same thread.
        self._bell: queue.SimpleQueue[None] = queue.SimpleQueue()

    def is_set(self) -> bool:
        """Return True once it has been set."""
        return self._set

    def set(self) -> None:
        """Set it, and let everybody go on who waits for it."""
        self._set = True
        self._bell.put(None)

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it is set, at most `timeout` seconds; return whether it is."""
        if not self._set:
            try:
                self._bell.get(timeout=None if timeout is None else max(0.0, timeout))
            except queue.Empty:
                return self._set
            self._bell.put(None)  # for the next one that waits
        return True
