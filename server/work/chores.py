"""Chores of a worker beside its runs: rows of deleted runs, data of people, older checkpoints.

A chore is done in pieces, each a short transaction, between the rounds of the worker's loop; only the
deletion of a person's data has a thread of its own (`server.work.erasures`). Several workers may do the same
one: a piece that is gone already is passed over.
"""

from __future__ import annotations

import math
import time

import structlog

from parenting.server import checkpoints, deletion, erasure, weights
from parenting.server.checkpoint_parts import LONGEST_REST, REST
from parenting.server.db import Database
from parenting.server.work.courtesy import Courtesy
from parenting.server.work.erasures import Erasures

log = structlog.get_logger()

LOOK_SECONDS = 1.0
"""Seconds between two looks for a chore, at the least."""


class Chores:
    """The chores of a worker: one at a time, and the deletion of one person's data beside it."""

    def __init__(self, db: Database, seconds: float, courtesy: Courtesy | None = None) -> None:
        """Nothing is to be done yet.

        Args:
            db: The database.
            seconds: How long a run's claim holds without a sign of life.
            courtesy: The turns of runs before which a deletion stands back.
        """
        self.db, self.seconds = db, seconds
        self.erasures = Erasures(db, courtesy)
        self._deleted: int | None = None
        self._thinned: int | None = None
        self._done: int | None = None
        self._kept: set[int] = set()
        self._swept = False
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
            self._look()
        if self._deleted is not None:
            if deletion.piece(self.db, self._deleted):
                log.info("run deleted", run=self._deleted)
                self._deleted = None
        elif self._thinned is not None and not checkpoints.thin(self.db, self._thinned, self.seconds):
            self._done, self._thinned = self._thinned, None
        busy = self._deleted is not None or self._thinned is not None
        rest = min(LONGEST_REST, REST * (time.monotonic() - began))
        self._due = time.monotonic() + (rest if busy else LOOK_SECONDS if self._news else self.seconds / 2)
        self._news = False

    def _look(self) -> None:
        self._deleted = next(iter(deletion.under_way(self.db)), None)
        if self._deleted is not None:
            return
        if self.erasures.may_begin() and (waiting := erasure.under_way(self.db)):
            self.erasures.begin(waiting[0].id)
        self._thinned = checkpoints.ended_with_more(self.db, self.seconds, self._kept)
        if self._thinned is not None and self._thinned == self._done:  # its last one is damaged, so both stay
            self._kept.add(self._thinned)
            self._thinned = None
        if self._thinned is None and not self._swept:
            if removed := weights.sweep(self.db):
                log.info("policies and answers of deleted runs removed", rows=removed)
            self._swept = True
