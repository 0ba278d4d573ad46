"""Chores of a worker beside its runs: rows of deleted runs, data of people, older checkpoints.

A chore is done in pieces, each a short transaction, between the rounds of the worker's loop. Several workers
may do the same one: a piece that is gone already is passed over.
"""

from __future__ import annotations

import math
import time

import structlog

from parenting.server import checkpoints, deletion, erasing, erasure, weights
from parenting.server.checkpoint_parts import LONGEST_REST, REST
from parenting.server.db import Database
from parenting.server.errors import LostClaimError, ServerError

log = structlog.get_logger()

LOOK_SECONDS = 1.0
"""Seconds between two looks for a chore, at the least."""
AGAIN_SECONDS = 10.0
"""Seconds after which a deletion of a person's data is tried again."""


class Chores:
    """The chores of a worker: one at a time."""

    def __init__(self, db: Database, seconds: float) -> None:
        """Nothing is to be done yet; `seconds` is how long a run's claim holds without a sign of life."""
        self.db, self.seconds = db, seconds
        self._deleted: int | None = None
        self._thinned: int | None = None
        self._done: int | None = None
        self._kept: set[int] = set()
        self._swept = False
        self._person: int | None = None
        self._again = -math.inf
        self._news, self._due = True, -math.inf

    def news(self) -> None:
        """Take note that somebody has committed something: there may be a chore."""
        self._news = True

    def go_on(self) -> None:
        """Do a piece of what is to be done, if there is anything and it is time."""
        began = time.monotonic()
        if began < self._due:
            return
        if self._deleted is None and self._thinned is None:
            self._look(began)
        if self._deleted is not None:
            if deletion.piece(self.db, self._deleted):
                log.info("run deleted", run=self._deleted)
                self._deleted = None
        elif self._person is not None:
            self._erase(self._person)
        elif self._thinned is not None and not checkpoints.thin(self.db, self._thinned, self.seconds):
            self._done, self._thinned = self._thinned, None
        busy = self._deleted is not None or self._thinned is not None
        rest = min(LONGEST_REST, REST * (time.monotonic() - began))
        self._due = time.monotonic() + (rest if busy else LOOK_SECONDS if self._news else self.seconds / 2)
        self._news = False

    def _erase(self, person_id: int) -> None:
        """Delete a person's data; what does not succeed now is tried again later."""
        self._person = None
        try:
            done = erasing.go_on(self.db, person_id)
        except (LostClaimError, ServerError) as error:
            self._again = time.monotonic() + AGAIN_SECONDS
            log.warning("a person's data are not all deleted yet", why=error.message)
            return
        self._again = -math.inf if done else time.monotonic() + AGAIN_SECONDS
        log.info("a person's data were deleted" if done else "the store's log holds a person's data still")

    def _look(self, now: float) -> None:
        self._deleted = next(iter(deletion.under_way(self.db)), None)
        if self._deleted is not None:
            return
        waiting = erasure.under_way(self.db) if now >= self._again else ()
        self._person = next((one.id for one in waiting), None)
        if self._person is not None:
            return
        self._thinned = checkpoints.ended_with_more(self.db, self.seconds, self._kept)
        if self._thinned is not None and self._thinned == self._done:  # its last one is damaged, so both stay
            self._kept.add(self._thinned)
            self._thinned = None
        if self._thinned is None and not self._swept:
            if removed := weights.sweep(self.db):
                log.info("policies and answers of deleted runs removed", rows=removed)
            self._swept = True
