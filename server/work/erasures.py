"""The deletion of people's data by a worker: one at a time, in a thread of its own.

Runs that others answered as well are relived for it, which may take minutes, and the file is written afresh.
So the worker's loop only begins it. A process that ends meanwhile leaves the rest to another one
(`server.erasing`).
"""

from __future__ import annotations

import math
import threading
import time

import structlog
import torch

from parenting.server import erasing
from parenting.server.db import Database
from parenting.server.errors import LostClaimError, ServerError
from parenting.server.work.courtesy import Courtesy

log = structlog.get_logger()

AGAIN_SECONDS = 10.0
"""Seconds after which a deletion is tried again."""


class Erasures:
    """The deletion that a worker is at."""

    def __init__(self, db: Database, courtesy: Courtesy | None = None) -> None:
        """Nothing is deleted yet; turns of runs for which people wait go before what is, by `courtesy`."""
        self.db, self._courtesy = db, courtesy or Courtesy()
        self._thread: threading.Thread | None = None
        self._again = -math.inf

    def may_begin(self) -> bool:
        """Return whether none goes on, nor is one to be tried again later only."""
        return not self.working() and time.monotonic() >= self._again

    def working(self) -> bool:
        """Return whether a deletion goes on."""
        return self._thread is not None and self._thread.is_alive()

    def begin(self, person_id: int) -> None:
        """Begin to delete the data of a person who is marked."""
        self._thread = threading.Thread(
            target=self._do, args=(person_id,), name="a person's data", daemon=True
        )
        self._thread.start()

    def _do(self, person_id: int) -> None:
        """Delete them; what does not succeed now is tried again later."""
        torch.set_num_threads(1)
        try:
            with self._courtesy.turn(None, hurried=False):
                done = erasing.go_on(self.db, person_id)
        except (LostClaimError, ServerError) as error:
            self._again = time.monotonic() + AGAIN_SECONDS
            log.warning("a person's data are not all deleted yet", why=error.message)
            return
        except Exception:  # of this thread nobody else would hear
            self._again = time.monotonic() + AGAIN_SECONDS
            log.exception("a person's data could not be deleted")
            return
        self._again = -math.inf if done else time.monotonic() + AGAIN_SECONDS
        log.info("a person's data were deleted" if done else "the store's log holds a person's data still")
