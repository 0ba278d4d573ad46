"""The worker: it raises every run in turn, a few ticks each, and waits for parents that have not answered.

Between rounds it waits for a notification, which the web sends after each answer, and polls every 75 ms. A
run has a turn only when something is new for it or due, so that a waiting run costs nothing. Its sign of life
is that of its worker, which another thread gives.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Sequence
from functools import partial
from types import FrameType

import structlog

from parenting.server import runs, workers
from parenting.server.db import Database
from parenting.server.errors import StoreError
from parenting.server.notify import Notifier
from parenting.server.settings import Settings
from parenting.server.signal_event import SignalEvent
from parenting.server.store.relay import Relay
from parenting.server.trackers.stored import chosen_feeds
from parenting.server.work.chores import Chores
from parenting.server.work.held import HeldRuns
from parenting.server.work.jobs import Jobs
from parenting.server.work.load import Load
from parenting.server.work.patience import Patience
from parenting.server.work.schedule import Schedule
from parenting.server.work.sharing import prospect, surplus
from parenting.server.work.signs import Signs
from parenting.server.work.turns import HUNG_SECONDS, SLOW_SECONDS, Turns
from parenting.server.work.watching import News, Watching

log = structlog.get_logger()

POLL_SECONDS = 0.075
"""An answer is heard within 100 ms even where its hint was lost (C8): after one poll at most, and a tick."""
CLAIM_EVERY = 0.25
QUIET_SECONDS = 2.5
"""Seconds between two looks for runs where nobody commits: what a lost worker raised goes on within 5 s."""
ROUND_SECONDS = 0.1
"""A round that has taken so long begins no third turn: somebody else may be more urgent by now."""
CLOSE_SECONDS = 3.0
"""Seconds that saving at the end may take. What is not saved by then goes on from its last checkpoint."""
JOB_SECONDS = 0.2
"""Seconds that an end waits for jobs; another worker does again what is not done by then."""


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
        self.name = workers.new_name(os.getpid())
        self.notifier, self.web_notifier = Notifier(settings.data, "worker"), Notifier(settings.data, "web")
        self.relay = Relay(db.engine, "worker", self.notifier.wake)
        self.told = SignalEvent()
        self.patience, self.turns = Patience(), Turns(self.notifier.wake, beside_after)
        self.jobs = Jobs(db, settings.claim_seconds, self.notifier.wake, self.turns.courtesy)
        self.chores = Chores(db, settings.claim_seconds, self.turns.courtesy)
        self.held = HeldRuns(
            db,
            self.patience,
            self.web_notifier.notify,
            chosen_feeds(settings.trackers),
            settings.lives,
            1e6 * settings.lives_megabytes,
        )
        self.claims, self.sessions = self.held.claims, self.held.sessions
        self.schedule, self.watching, self.load = Schedule(), Watching(db), Load()
        every = min(workers.SIGN_SECONDS, settings.claim_seconds / 4)
        self.signs = Signs(self._give_sign, every, HUNG_SECONDS, self.patience)
        self._round_seconds = math.inf if beside_after is None else ROUND_SECONDS
        self._found: News | None = None
        self._lost: set[int] = set()
        self._claimed_at, self._committed, self._soonest = -math.inf, True, POLL_SECONDS

    @property
    def stopping(self) -> bool:
        """Return whether it was told to stop."""
        return self.told.is_set()

    def stop(self, _signal: int = 0, _frame: FrameType | None = None) -> None:
        """Finish the ticks in hand, save everything and end."""
        self.told.set()

    def working(self) -> bool:
        """Return whether anything goes on in a thread for which the loop's end does not wait."""
        return bool(self.turns.working()) or self.jobs.working() or self.chores.erasures.working()

    # The loop

    def work(self) -> None:
        """Raise runs in turn until stopped, then save them and give them back."""
        self.relay.start()
        self.signs.start()
        while not self.stopping:
            try:
                self._go_on()
            except StoreError as error:
                self.patience.refused(error)
            if self.patience.waits:
                self.patient(self.signs.give)
        self._close()

    def patient(self, act: Callable[[], None]) -> None:
        """Do something as soon as the store does not refuse it, unless told to stop before."""
        while not self.told.wait(self.patience.left()):
            self.signs.round()
            try:
                act()
            except StoreError as error:
                self.patience.refused(error)
            else:
                return

    def _go_on(self) -> None:
        self.signs.round()
        ticked = self._round()
        self.signs.if_due(at_once=self.patience.doubts)
        fresh = self._claim()
        self.chores.go_on()
        if not (ticked or fresh):
            self.notifier.wait(self._soonest)

    def _give_sign(self) -> None:
        """Sign for this process and all that it raises, and give up the runs whose turn hangs."""
        figures = self.load.figures(len(self.claims), len(self.sessions), self.schedule.waited())
        workers.sign(self.db, self.name, figures)
        # Other threads drop claims meanwhile, so each is asked for once.
        hung = [claim for run_id in self.turns.working(HUNG_SECONDS) if (claim := self.claims.get(run_id))]
        if hung:
            runs.let_go(self.db, hung)
        self.jobs.renew()

    def _claim(self) -> bool:
        """Look for runs that nobody raises, up to a fair share, and give up what is above it.

        Without a commit of anybody, nothing but time can have freed a run. Return whether one was claimed.
        """
        late = time.monotonic() - self._claimed_at
        if late < (CLAIM_EVERY if self._committed else min(self.settings.claim_seconds / 2, QUIET_SECONDS)):
            return False
        seconds, fresh = self.settings.claim_seconds, list[runs.Claim]()
        most, free = prospect(self.db, self.name, seconds)
        self._give_up(most)
        if free and (more := most - len(self.claims)) > 0:
            hung = self.turns.working(HUNG_SECONDS)
            fresh += runs.claim(self.db, self.name, seconds, more, hung)
            self.claims.update({claim.run_id: claim for claim in fresh})
            self.held.lives.claimed(self.db, [claim.run_id for claim in fresh], len(self.claims))
        self._claimed_at, self._committed = time.monotonic(), False
        return bool(fresh)

    def _give_up(self, most: int) -> None:
        """Choose the runs that other workers should raise; each that has a life in memory has a last turn."""
        self.held.surplus = set(surplus(self.schedule.busy_first(self.claims), most))
        working = self.turns.working()
        if idle := self.held.surplus - self.sessions.keys() - working:
            # Other threads drop claims meanwhile, so each is asked for once.
            mine = [claim for run_id in idle if (claim := self.claims.get(run_id))]
            runs.let_go(self.db, mine)
            for run_id in idle:
                self.held.drop(run_id)
        self.schedule.hurry(self.held.surplus - idle)

    # A round

    def _round(self) -> bool:
        """Give runs that are due their turns, as far as threads are free and for `ROUND_SECONDS`.

        Return whether another turn is due at once.
        """
        self._end_turns()
        self._look()
        self.jobs.begin(self.name)
        due = self.schedule.due()
        away, seen = set(due) - self.sessions.keys(), self.schedule.seen
        self._make_room(sum(self.held.lives.comes(run_id, seen[run_id]) for run_id in away))
        late = bool(due) and self._begin_turns(due)
        ticked = self._end_turns()
        self._soonest = self.schedule.soonest(POLL_SECONDS)
        return ticked or late

    def _begin_turns(self, due: Sequence[int]) -> bool:
        """Begin turns in this order; return whether the time of the round was over before the last."""
        slow = self.turns.working(SLOW_SECONDS)
        self.held.lives.begin_round(self.schedule.seen, due, self.turns.working(), slow)
        until, begun = time.monotonic() + self._round_seconds, 0
        for run_id in due:
            if self.stopping or self.patience.doubts:
                return False
            if begun > 1 and time.monotonic() >= until:
                return True
            if self._may_begin(run_id):
                begun += 1
                seen = self.schedule.begin(run_id)
                self.held.pressed(self.schedule.people_wait())
                self.turns.begin(run_id, partial(self.held.turn, run_id, seen), seen.urgent)
                self.jobs.begin(self.name)
        return False

    def _may_begin(self, run_id: int) -> bool:
        """Return whether a run may have its turn now: a thread is free, and memory for its life."""
        seen, new = self.schedule.seen[run_id], run_id not in self.sessions
        if not self.turns.may_begin(run_id, new, seen.urgent):
            return False
        return not new or self.held.lives.may_come(run_id, seen)

    def _end_turns(self) -> bool:
        """Take note of the turns that have ended; return whether another one of such a run is due at once."""
        ended = self.turns.ended()
        self.watching.touched(ended.keys())
        return self.schedule.ended(ended)

    def _make_room(self, coming: int = 0) -> None:
        """Let lives that wait leave memory where there are too many, or others are coming."""
        lives = self.held.lives
        if not lives.crowded(coming):
            return
        self.schedule.end_leisure()
        guided = lives.guided() & set(self.schedule.not_due())  # else an answer would be passed over
        for run_id in lives.too_many(guided | set(self.schedule.at_rest()), coming):
            if self.turns.may_begin(run_id, new=False, urgent=True):  # others wait for that memory
                self.schedule.begin(run_id)
                self.turns.begin(run_id, partial(self.held.rest, run_id))

    def _look(self) -> None:
        """See what is new: a run is due if anything of it has changed."""
        working = self.turns.working()
        self.watching.touched(working)
        news = self.watching.look(self.name, self.claims)
        if news is not self._found:
            self._committed = True
            self._lost.update(news.lost)
            self.jobs.news()
            self.chores.news()
            self.schedule.news(news.found)
            if news.unknown:  # it was claimed, but nobody told: the store was gone before it could
                runs.let_go(self.db, news.unknown)
            self._found = news  # at the end: where the store refused, all of this is done again
        for run_id in self._lost - working:  # a turn that goes on finds out itself, at its next write
            self.held.drop(run_id)
        self._lost &= working
        self.schedule.keep(self.claims.keys())

    # The end

    def _close(self) -> None:
        """Save and let go of every run, as long as the time allows and the store takes it."""
        end = time.monotonic() + CLOSE_SECONDS
        self.turns.close(CLOSE_SECONDS / 2)
        self.jobs.close(JOB_SECONDS)
        self.signs.close()
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
