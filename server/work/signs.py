"""Signs of life of a worker, from a thread of their own: no turn and no wait of its loop holds them up.

One row says that the worker lives, and with it hold the claims on all of its runs (`runs.silent`): a run that
waits has no sign of its own. A run whose turn hangs is given up, so that another worker may take it. A loop
that hangs itself ends the signs, and so frees all.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import structlog

from parenting.server.errors import StoreError
from parenting.server.work.patience import Patience

log = structlog.get_logger()

CLOSE_SECONDS = 0.5
"""Seconds that an end waits for a sign that is just given."""


class Signs:
    """The signs of one worker: of its loop, or of a thread where one was started."""

    def __init__(self, give: Callable[[], None], every: float, hung: float, patience: Patience) -> None:
        """Nothing is signed yet.

        Args:
            give: Gives a sign; it may raise a StoreError.
            every: Seconds between two signs.
            hung: Seconds without a round after which the loop counts as hung.
            patience: The state of the store. While it refuses, the loop alone asks again.
        """
        self._give, self.every, self._hung, self._patience = give, every, hung, patience
        self._told, self._lock = threading.Event(), threading.Lock()
        self._thread: threading.Thread | None = None
        self.at = self._round = -float("inf")

    def start(self) -> None:
        """Give signs from now on, in a thread."""
        self.round()
        self._thread = threading.Thread(target=self._run, daemon=True, name="signs of life")
        self._thread.start()

    def round(self) -> None:
        """Take note that the loop goes on."""
        self._round = time.monotonic()

    def if_due(self, at_once: bool = False) -> None:
        """Give a sign if the last one is old. With a thread, that is if it does not come to it.

        Raises:
            StoreError: the store refuses it.
        """
        late = time.monotonic() - self.at
        if at_once or late >= (self.every if self._thread is None else 2 * self.every):
            self.give()

    def give(self) -> None:
        """Give a sign.

        Raises:
            StoreError: the store refuses it.
        """
        with self._lock:
            self._give()
            self.at = time.monotonic()
        self._patience.granted()

    def close(self) -> None:
        """Give no more signs."""
        self._told.set()
        if self._thread is not None:
            self._thread.join(CLOSE_SECONDS)

    def _run(self) -> None:
        while not self._told.wait(max(0.0, min(self.every, self.at + self.every - time.monotonic()))):
            lives = time.monotonic() - self._round < self._hung
            if self._patience.waits or not lives:
                self._told.wait(self.every)
                continue
            try:
                self.give()
            except StoreError as error:
                self._patience.refused(error)
            except Exception:
                log.exception("a sign of life could not be given")
                self._told.wait(self.every)
