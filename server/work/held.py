"""The runs that a worker holds: claims, sessions, and a turn of each. Turns may be in other threads."""

from __future__ import annotations

import math
import time
import traceback
from collections.abc import Callable, Collection
from functools import partial

import structlog

from parenting.server import runs
from parenting.server.db import Database
from parenting.server.errors import LostClaimError, StoreError
from parenting.server.failures import said_by
from parenting.server.growth import NotFiniteError
from parenting.server.pressure import Pressure
from parenting.server.queue.worker_side import Watch
from parenting.server.runs import Claim
from parenting.server.session import RunSession
from parenting.server.statuses import OVER, RunStatus
from parenting.server.trackers.feed import Feeds
from parenting.server.trackers.stored import TrackedRuns
from parenting.server.work.lives import Lives
from parenting.server.work.patience import Patience, back_off
from parenting.server.work.schedule import AT_LEISURE, AT_NEWS, NOW

log = structlog.get_logger()

SLICE_SECONDS = 0.01
"""Seconds that one run may go on after a tick before the next has its turn."""


class HeldRuns:
    """The runs that a worker has claimed. Only one thread at a time touches a run."""

    def __init__(
        self,
        db: Database,
        patience: Patience,
        asked: Callable[[int], None],
        told: Feeds | None = None,
        most: float = math.inf,
        most_bytes: float = math.inf,
    ) -> None:
        """Hold nothing yet.

        Args:
            db: The database.
            patience: The state of the store.
            asked: Called with the number of a run after each of its questions.
            told: The trackers.
            most: Lives that stay in memory, as far as the others wait.
            most_bytes: Bytes of those lives.
        """
        self.db, self._patience, self._asked = db, patience, asked
        self.tracked = TrackedRuns(db, told or Feeds([]))
        self.claims: dict[int, Claim] = {}
        self.sessions: dict[int, RunSession] = {}
        self.lives, self.pressure = Lives(self.sessions, most, most_bytes), Pressure()
        self.surplus: set[int] = set()
        self._refusals: dict[int, int] = {}

    def pressed(self, people_wait: bool) -> None:
        """Take note of what other runs ask of this worker, before a turn begins."""
        self.pressure.press(people_wait, len(self.sessions))

    def turn(self, run_id: int, seen: Watch) -> float:
        """Give one run its turn, and return when the next is due. A store error never fails a run."""
        try:
            due = self._tried(run_id, seen)
            if self._refusals.pop(run_id, None):
                self._patience.dispelled()
            return due
        except LostClaimError as error:
            log.warning("run lost", run=run_id, reason=error.message)
            self.drop(run_id)
        except StoreError as error:
            self._patience.doubted(error, run_id)
            self._refusals[run_id] = self._refusals.get(run_id, 0) + 1
            session = self.sessions.get(run_id)
            if session is not None and not session.whole:
                del self.sessions[run_id]  # it goes on from its checkpoint
            return time.monotonic() + back_off(self._refusals[run_id])
        return AT_NEWS

    def _tried(self, run_id: int, seen: Watch) -> float:
        """Give one run its turn. A run that fails stops alone, with its reason."""
        try:
            if run_id in self.surplus or seen.status in OVER:
                return self._last(run_id, seen.status in OVER)
            if seen.status is not RunStatus.ACTIVE:
                return self._paused(run_id)
            if self.lives.sleeps(run_id, seen):
                return AT_NEWS
            due = self._usual(run_id, seen)
            self.lives.used(run_id)
            return due
        except (LostClaimError, StoreError):
            raise
        except Exception as error:
            log.error("run failed", run=run_id, error=repr(error))
            ours = isinstance(error, NotFiniteError)
            reason = str(error) if ours else f"The agent could not go on: {said_by(error)}"
            runs.finish(self.db, self.claims[run_id], RunStatus.FAILED, reason, traceback.format_exc())
            self.drop(run_id)
        return AT_NEWS

    def _usual(self, run_id: int, seen: Watch) -> float:
        session = self.sessions.get(run_id) or self._begin(run_id)
        if session.finished():  # the store refused to note it
            return self._finish(session)
        if not session.ready(seen):
            session.report_waiting(seen)
            return self._finish(session) if session.finished() else session.rests_until()
        if (delay := session.delay(seen.pace)) > 0:
            session.catch_up()
            return time.monotonic() + delay
        go_on = session.tick(seen) and seen.pace is None and not seen.goal_reached
        until = time.monotonic() + SLICE_SECONDS
        while go_on and time.monotonic() < until and not session.finished():
            go_on = session.tick()
        if session.finished():
            return self._finish(session)
        replays = session.last_tick <= session.record_ends  # which changes nothing that `seen` tells
        at_once = go_on or replays or seen.pace is not None or not session.unmeasured
        return NOW if at_once else AT_LEISURE

    def _paused(self, run_id: int) -> float:
        """Do what was put off of a run that somebody has paused."""
        if (session := self.sessions.get(run_id)) is not None:
            session.catch_up()
        return AT_NEWS

    def _finish(self, session: RunSession) -> float:
        if session.board.completes(session.saved):
            return NOW
        session.end()
        runs.finish(self.db, session.claim, RunStatus.FINISHED, session.finish.reason)
        self.drop(session.claim.run_id)
        return NOW

    def _begin(self, run_id: int) -> RunSession:
        run = runs.get_run(self.db, run_id)
        asked = partial(self._asked, run_id)
        self.sessions[run_id] = RunSession(self.db, self.claims[run_id], run, asked, self.pressure)
        self.sessions[run_id].told = self.tracked.begin(run)
        log.info("run taken up", run=run_id, tick=self.sessions[run_id].last_tick)
        return self.sessions[run_id]

    def rest(self, run_id: int) -> float:
        """Let the life of a run that waits leave memory, after a checkpoint."""
        session = self.sessions.get(run_id)
        if session is None:
            return AT_NEWS
        try:
            session.catch_up()
            if session.unsaved:
                session.save()
        except LostClaimError as error:
            log.warning("run lost", run=run_id, reason=error.message)
            self.drop(run_id)
        except StoreError as error:
            self._patience.doubted(error, run_id)
        else:
            self.lives.leave(run_id)
        return AT_NEWS

    def _last(self, run_id: int, over: bool) -> float:
        """Save what was ticked of a run that somebody stopped, or that another worker raises, and let go.

        A run that is resumed can so be claimed at once.
        """
        session = self.sessions.get(run_id)
        if session is not None and run_id not in self.surplus and session.board.completes(session.saved):
            return NOW
        if session is not None and session.unsaved:
            session.over = over  # it waits for nobody
            session.catch_up()
            session.save(last=True)
        runs.let_go(self.db, [self.claims[run_id]])
        self.drop(run_id)
        return AT_NEWS

    def drop(self, run_id: int) -> None:
        """Hold a run no longer."""
        self.sessions.pop(run_id, None)
        self.lives.forget(run_id)
        self.tracked.end(run_id)
        self.claims.pop(run_id, None)

    def save(self, working: Collection[int], end: float) -> None:
        """Save every run whose turn is not just going on, until the time is over; then what was put off."""
        here = list(self.sessions.items())  # a turn that goes on may drop its own meanwhile
        mine = {run_id: one for run_id, one in here if run_id not in working and one.whole}
        for run_id, session in mine.items():
            if time.monotonic() > end:
                log.warning("not all runs could be saved in time; they go on from their checkpoints")
                return
            if session.unsaved:
                self._unless_lost(run_id, session.save)
        for run_id, session in mine.items():
            if run_id in self.sessions and time.monotonic() <= end:
                self._unless_lost(run_id, session.catch_up)

    def _unless_lost(self, run_id: int, act: Callable[[], None]) -> None:
        try:
            act()
        except LostClaimError:
            self.drop(run_id)
