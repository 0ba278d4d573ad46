"""The worker: it raises every run in turn, a few ticks each, and waits for parents that have not answered.

Between rounds it waits for a notification, which the web sends after each answer, and polls every 50 ms. A
run has a turn only when something is new for it or due, so that a waiting run costs nothing.
"""

from __future__ import annotations

import gc
import math
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from types import FrameType

import structlog

from parenting._process import settle
from parenting.envs import registry
from parenting.server import runs, workers
from parenting.server.db import Database, connect
from parenting.server.errors import StoreError
from parenting.server.migrate import require_current
from parenting.server.notify import Notifier
from parenting.server.queue import worker_side
from parenting.server.queue.worker_side import Watch
from parenting.server.settings import Settings
from parenting.server.store.relay import Relay
from parenting.server.trackers.stored import chosen_feeds
from parenting.server.work.chores import Chores
from parenting.server.work.held import AT_NEWS, NOW, HeldRuns
from parenting.server.work.jobs import Jobs
from parenting.server.work.patience import Patience
from parenting.server.work.sharing import prospect, surplus
from parenting.server.work.turns import BESIDE_SECONDS, HUNG_SECONDS, Turns
from parenting.server.workers import SIGN_SECONDS

log = structlog.get_logger()

POLL_SECONDS = 0.05
CLAIM_EVERY = 0.5
CLOSE_SECONDS = 3.0
"""Seconds that saving at the end may take. What is not saved by then goes on from its last checkpoint."""
JOB_SECONDS = 0.2
"""Seconds that an end waits for jobs; another worker does again what is not done by then."""
SWITCH_SECONDS = 0.001
"""A thread that waits for Python's lock gets it after so long: a tick takes it some hundred times."""
STOP_SECONDS = 3.5
"""A worker that has not ended so long after the signal ends anyway: a store may hold its threads."""


class Worker:
    """A worker process that raises runs until it is told to stop."""

    def __init__(self, db: Database, settings: Settings, beside_after: float | None = None) -> None:
        """Make a worker with a name of its own, which has claimed nothing yet.

        Args:
            db: The database.
            settings: The settings of the worker process.
            beside_after: Seconds after which a turn goes on beside the others; None waits for its end.
        """
        self.db, self.settings = db, settings
        self.name = f"{socket.gethostname()}:{os.getpid()}"
        self.notifier, self.web_notifier = Notifier(settings.data, "worker"), Notifier(settings.data, "web")
        self.relay = Relay(db.engine, "worker", self.notifier.wake)
        self.told = threading.Event()
        self.patience, self.turns = Patience(), Turns(self.notifier.wake, beside_after)
        self.jobs = Jobs(db, settings.claim_seconds, self.notifier.wake)
        self.chores = Chores(db, settings.claim_seconds)
        self.held = HeldRuns(db, self.patience, self.web_notifier.notify, chosen_feeds(settings.trackers))
        self.claims, self.sessions = self.held.claims, self.held.sessions
        self._found: dict[int, Watch] = {}
        self._seen: dict[int, Watch] = {}
        self._given: dict[int, Watch] = {}
        self._due: dict[int, float] = {}
        self._claimed_at, self._signed_at, self._committed = -math.inf, -math.inf, True
        self._soonest = POLL_SECONDS

    @property
    def stopping(self) -> bool:
        """Return whether it was told to stop."""
        return self.told.is_set()

    def stop(self, _signal: int = 0, _frame: FrameType | None = None) -> None:
        """Finish the ticks in hand, save everything and end."""
        self.told.set()

    # The loop

    def work(self) -> None:
        """Raise runs in turn until stopped, then save them and give them back."""
        self.relay.start()
        while not self.stopping:
            try:
                self._go_on()
            except StoreError as error:
                self.patience.refused(error)
            if self.patience.waits:
                self.patient(partial(self._sign, at_once=True))
        self._close()

    def patient(self, act: Callable[[], None]) -> None:
        """Do something as soon as the store does not refuse it, unless told to stop before."""
        while not self.told.wait(self.patience.left()):
            try:
                act()
            except StoreError as error:
                self.patience.refused(error)
            else:
                return

    def _go_on(self) -> None:
        ticked = self._round()
        self._sign(at_once=self.patience.doubts)
        self._claim()
        self.chores.go_on()
        if not ticked:
            self.notifier.wait(self._soonest)

    def _sign(self, at_once: bool = False) -> None:
        """A sign of life of this process, and of all that it raises, but for a run whose turn hangs."""
        now = time.monotonic()
        if not at_once and now - self._signed_at < min(SIGN_SECONDS, self.settings.claim_seconds / 4):
            return
        workers.sign(self.db, self.name)
        hung = self.turns.working(HUNG_SECONDS)
        mine = [claim for run_id, claim in list(self.claims.items()) if run_id not in hung]
        kept, busy = {claim.run_id for claim in runs.heartbeat(self.db, mine)}, self.turns.working()
        for claim in mine:
            if claim.run_id not in kept and claim.run_id not in busy:
                self.held.drop(claim.run_id)  # a turn that goes on finds out itself, at its next write
        self.jobs.renew()
        self._signed_at = now
        self.patience.granted()

    def _claim(self) -> None:
        """Look for runs that nobody raises, up to a fair share, and give up what is above it.

        Without a commit of anybody, nothing but time can have freed a run.
        """
        late = time.monotonic() - self._claimed_at
        if late < (CLAIM_EVERY if self._committed else self.settings.claim_seconds / 2):
            return
        seconds = self.settings.claim_seconds
        most, free = prospect(self.db, self.name, seconds)
        self._give_up(most)
        if free and (more := most - len(self.claims)) > 0:
            hung = self.turns.working(HUNG_SECONDS)
            fresh = runs.claim(self.db, self.name, seconds, more, hung)
            self.claims.update({claim.run_id: claim for claim in fresh})
        self._claimed_at, self._committed = time.monotonic(), False

    def _give_up(self, most: int) -> None:
        """Choose the runs that other workers should raise; each has a last turn."""
        order = sorted(self.claims, key=lambda run_id: (self._due.get(run_id, AT_NEWS), run_id))
        self.held.surplus = set(surplus(order, most))
        self._due.update(dict.fromkeys(self.held.surplus & self._due.keys(), NOW))

    # A round

    def _round(self) -> bool:
        """Give every run that is due its turn, first those with an answer; return whether any has ticked."""
        self._end_turns()
        self._look()
        self.jobs.begin(self.name)
        now = time.monotonic()
        due = [run_id for run_id, at in self._due.items() if at <= now]
        for run_id in sorted(due, key=lambda run_id: not self._seen[run_id].answers):
            if self.stopping or self.patience.doubts:
                break
            if self.turns.may_begin(run_id, run_id not in self.sessions):
                self._given[run_id] = self._seen[run_id]
                self.turns.begin(run_id, partial(self.held.turn, run_id, self._seen[run_id]))
                self.jobs.begin(self.name)
        ticked, now = self._end_turns(), time.monotonic()
        self._soonest = min([POLL_SECONDS, *(at - now for at in self._due.values() if at > now)])
        return ticked

    def _end_turns(self) -> bool:
        """Take note of the turns that have ended; return whether another one of such a run is due at once."""
        at_once = False
        for run_id, due in self.turns.ended().items():
            given = self._given.pop(run_id)
            if run_id in self._due:
                self._due[run_id] = due if self._seen.get(run_id) is given else NOW
                at_once |= self._due[run_id] == NOW
        return at_once

    def _look(self) -> None:
        """See what is new: a run is due if anything of it has changed."""
        found = worker_side.watch(self.db, list(self.claims))
        if found is self._found:
            return  # nobody has committed anything
        self._found, self._committed = found, True
        self.jobs.news()
        self.chores.news()
        for run_id, seen in found.items():
            if self._seen.get(run_id) != seen:
                self._seen[run_id], self._due[run_id] = seen, NOW
        for run_id in self._seen.keys() - found.keys():
            del self._seen[run_id], self._due[run_id]

    # The end

    def _close(self) -> None:
        """Save and let go of every run, as long as the time allows and the store takes it."""
        end = time.monotonic() + CLOSE_SECONDS
        self.turns.close(CLOSE_SECONDS / 2)
        self.jobs.close(JOB_SECONDS)
        try:
            self.held.save(self.turns.working(), end)
            runs.let_go(self.db, list(self.claims.values()))
            self.jobs.let_go()
            workers.sign_off(self.db, self.name)
        except StoreError as error:
            log.warning("store refuses at the end; runs go on from their checkpoints", why=error.message)
        self.held.tracked.close()
        self.relay.close()
        self.notifier.close()


def main(settings: Settings) -> int:
    """Raise the runs of this database until SIGTERM or SIGINT.

    The work is in another thread: this one hears signals, and ends the process in time even while the store
    holds the other.

    Raises:
        SetupError: the database cannot be used as it is.
    """
    settle()
    sys.setswitchinterval(SWITCH_SECONDS)
    for broken in registry.INSTALLED.broken().values():
        log.warning(broken)
    worker = Worker(connect(settings), settings, BESIDE_SECONDS)
    signal.signal(signal.SIGTERM, worker.stop)
    signal.signal(signal.SIGINT, worker.stop)
    worker.patient(partial(require_current, worker.db))
    if settings.ballast:
        worker.db.keep_ballast()
    gc.freeze()  # loaded modules stay: searching them for garbage takes a tenth of a second
    failed: list[BaseException] = []
    loop = threading.Thread(target=_keep, args=(worker.work, worker.told, failed), name="worker", daemon=True)
    loop.start()
    worker.told.wait()
    loop.join(STOP_SECONDS)
    if failed:
        raise failed[0]
    if loop.is_alive() or worker.turns.working() or worker.jobs.working():
        sys.stderr.flush()
        os._exit(0)  # whatever goes on is lost, and done again from the last checkpoint
    worker.db.close()
    return 0


def _keep(work: Callable[[], None], told: threading.Event, failed: list[BaseException]) -> None:
    """Call a function and keep what it raises for the main thread."""
    try:
        work()
    except BaseException as error:
        failed.append(error)
    finally:
        told.set()
