"""The worker: it raises every run in turn, a few ticks each, and waits for parents that have not answered.

Between rounds it waits for a notification, which the web sends after each answer, and polls every 50 ms.
"""

from __future__ import annotations

import gc
import os
import signal
import socket
import time
import traceback
from contextlib import suppress
from types import FrameType

import structlog

from parenting._process import settle
from parenting.server import runs, workers
from parenting.server.db import Database, connect
from parenting.server.errors import BusyError, DiskFullError, LostClaimError
from parenting.server.migrate import require_current
from parenting.server.notify import Notifier
from parenting.server.queue import worker_side
from parenting.server.queue.worker_side import Watch
from parenting.server.runs import Claim
from parenting.server.session import RunSession, goal_reached
from parenting.server.settings import Settings
from parenting.server.statuses import OVER, RunStatus

log = structlog.get_logger()

POLL_SECONDS = 0.05
SLICE_SECONDS = 0.01
"""Seconds that one run may go on after a tick before the next has its turn."""
CLAIM_EVERY = 0.5


class Worker:
    """A worker process that raises runs until it is told to stop."""

    def __init__(self, db: Database, settings: Settings) -> None:
        """Make a worker with a name of its own, which has claimed nothing yet."""
        self.db, self.settings = db, settings
        self.name = f"{socket.gethostname()}:{os.getpid()}"
        self.claims: dict[int, Claim] = {}
        self.sessions: dict[int, RunSession] = {}
        self.notifier, self.web_notifier = Notifier(settings.data, "worker"), Notifier(settings.data, "web")
        self.stopping = False
        self._claimed_at, self._signed_at = 0.0, -workers.SIGN_SECONDS
        self._soonest = POLL_SECONDS

    def stop(self, _signal: int = 0, _frame: FrameType | None = None) -> None:
        """Finish the tick in hand, save everything and end."""
        self.stopping = True

    def work(self) -> None:
        """Raise runs in turn until stopped, then save them and give them back."""
        self.notifier.listen()
        try:
            while not self.stopping:
                self._soonest = POLL_SECONDS
                ticked = self._round()
                self._sign()
                self._claim(2 * CLAIM_EVERY if ticked else CLAIM_EVERY)
                if not ticked:
                    self.notifier.wait(self._soonest)
        finally:
            self._close()

    def _sign(self) -> None:
        """A sign of session of this process, with runs or without."""
        if time.monotonic() - self._signed_at >= workers.SIGN_SECONDS:
            workers.sign(self.db, self.name)
            self._signed_at = time.monotonic()

    def _claim(self, every: float = CLAIM_EVERY) -> None:
        """Signs of session for what we raise, and a look for runs that nobody raises.

        While something lives it comes less often: a person may wait for the next question.
        """
        now = time.monotonic()
        if now - self._claimed_at < every:
            return
        self._claimed_at = now
        kept = runs.heartbeat(self.db, list(self.claims.values()))
        fresh = runs.claim(self.db, self.name, self.settings.claim_seconds)
        self.claims = {claim.run_id: claim for claim in (*kept, *fresh)}
        self.sessions = {
            run_id: session
            for run_id, session in self.sessions.items()
            if session.claim == self.claims.get(run_id)
        }

    def _round(self) -> bool:
        """Give every run its turn, first those with an answer; return whether any tick has passed."""
        ticked = False
        found = worker_side.watch(self.db, list(self.claims))
        for run_id, seen in sorted(found.items(), key=lambda item: not item[1].answers):
            if seen.status in OVER:
                self._end(run_id)
            elif seen.status is RunStatus.ACTIVE and not self.stopping:
                ticked |= self._guarded(run_id, seen)
        return ticked

    def _guarded(self, run_id: int, seen: Watch) -> bool:
        """Give one run its turn. A run that fails stops alone, with its reason."""
        try:
            return self._turn(run_id, seen)
        except LostClaimError as error:
            log.warning("run lost", run=run_id, reason=error.message)
            self._drop(run_id)
        except (BusyError, DiskFullError) as error:
            log.warning(
                "store refused; the run goes on from its checkpoint", run=run_id, reason=error.message
            )
            self.sessions.pop(run_id, None)
        except Exception as error:
            log.error("run failed", run=run_id, error=repr(error))
            reason = f"The agent could not go on: {error}"
            runs.finish(self.db, self.claims[run_id], RunStatus.FAILED, reason, traceback.format_exc())
            self._drop(run_id)
        return False

    def _turn(self, run_id: int, seen: Watch) -> bool:
        session = self.sessions.get(run_id) or self._begin(run_id)
        if not session.ready(seen):
            session.report_waiting(seen)
            return False
        if (delay := session.delay(seen.pace)) > 0:
            self._soonest = min(self._soonest, delay)
            return False
        go_on = session.tick(seen) and seen.pace is None and not goal_reached(seen)
        until = time.monotonic() + SLICE_SECONDS
        while go_on and time.monotonic() < until and not session.finished():
            go_on = session.tick()
        if session.finished():
            session.save()
            runs.finish(self.db, session.claim, RunStatus.FINISHED, "Its argmax policy is optimal.")
            self._drop(run_id)
        return True

    def _begin(self, run_id: int) -> RunSession:
        run = runs.get_run(self.db, run_id)
        self.sessions[run_id] = RunSession(self.db, self.claims[run_id], run, self.web_notifier.notify)
        log.info("run taken up", run=run_id, tick=self.sessions[run_id].last_tick)
        return self.sessions[run_id]

    def _end(self, run_id: int) -> None:
        """Save what was ticked of a run that somebody stopped, and let go of it."""
        if run_id in self.sessions:
            with suppress(LostClaimError):
                self.sessions[run_id].save()
        self._drop(run_id)

    def _drop(self, run_id: int) -> None:
        self.sessions.pop(run_id, None)
        self.claims.pop(run_id, None)

    def _close(self) -> None:
        for run_id, session in list(self.sessions.items()):
            try:
                session.save()
            except LostClaimError:
                self._drop(run_id)
        runs.let_go(self.db, list(self.claims.values()))
        workers.sign_off(self.db, self.name)
        self.notifier.close()


def main(settings: Settings) -> int:
    """Raise the runs of this database until SIGTERM or SIGINT."""
    settle()
    db = connect(settings)
    require_current(db)
    worker = Worker(db, settings)
    gc.freeze()  # loaded modules stay: searching them for garbage takes a tenth of a second
    signal.signal(signal.SIGTERM, worker.stop)
    signal.signal(signal.SIGINT, worker.stop)
    worker.work()
    db.close()
    return 0
