"""A bound for the log: while the store refuses, every request would write the same line."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any


class LogLimit:
    """At most one line a second under each key; the next line says how many were left out.

    Keys must be few and known, such as codes of errors: each is remembered.
    """

    def __init__(self, seconds: float = 1.0, clock: Callable[[], float] = time.monotonic) -> None:
        self._seconds, self._clock = seconds, clock
        self._lock = threading.Lock()
        self._said: dict[str, float] = {}
        self._repeated: dict[str, int] = {}

    def say(self, key: str, log: Callable[..., Any], event: str, **fields: Any) -> None:
        """Call `log(event, ...)`, unless the same key was logged within the second."""
        with self._lock:
            now = self._clock()
            if now - self._said.get(key, float("-inf")) < self._seconds:
                self._repeated[key] = self._repeated.get(key, 0) + 1
                return
            self._said[key], repeated = now, self._repeated.pop(key, 0)
        log(event, **fields, **({"repeated": repeated} if repeated else {}))
