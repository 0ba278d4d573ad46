"""Live streams: browsers follow runs by server-sent events, and requests for a question lie here.

However many follow however many runs, one task looks at all of them with one read of the database, four times
a second and after a notification of a run that has streams. Who waits for a question of the run asks for it
at once, without that look. All else is told at most once in 250 ms, and what is told of a run is written once
for all of its streams. Where many streams are open, each is told less often. Streams end at once when the
server stops.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import TypeVar

import structlog
from fastapi.sse import ServerSentEvent

from parenting.server.access.staying import Stay
from parenting.server.admission import Admission
from parenting.server.db import Database
from parenting.server.errors import ServerError, StoreError, TooManyStreamsError
from parenting.server.notify import Notifier
from parenting.server.reads.watching import Look, look, told_metrics, told_runs
from parenting.server.store.relay import Relay
from parenting.server.subscriptions import UNSURE_SECONDS, Subscription, either

log = structlog.get_logger()

POLL_SECONDS = 0.25
"""Seconds between looks, and at least between two events of the same run, questions and leases excepted."""
REST = 9
"""The watcher rests for so many times the processor's time that a look took, `LONGEST_REST` at most."""
LONGEST_REST = 0.1
STREAM_SECONDS, SELDOM_SECONDS = 0.005, 1.0
"""A run's streams are told at most once in so many seconds for each stream of the process, up to the second:
each costs the processor a fraction of a millisecond, which answers would have."""
AGAIN_SECONDS = 5.0
"""Seconds after which who waits for a question asks again, whether anything was seen to change or not: a
precaution only, as the watcher sees each commit within a quarter of a second."""
GONE_SECONDS = 1.0
"""Seconds between two looks at whether who waits for a question is still there."""

Found = TypeVar("Found")


class Streams:
    """All live streams of this process."""

    def __init__(self, db: Database, notifier: Notifier, limit: int, admission: Admission) -> None:
        self.db, self.notifier, self.limit, self.admission = db, notifier, limit, admission
        self.subscriptions: dict[int, Subscription] = {}
        self.numbers: dict[str, int] = {}
        """The numbers of runs by their public ids, as far as they were asked for."""
        self.relay = Relay(db.engine, "web", notifier.wake)
        self.closed = False
        self._news = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._watcher: asyncio.Task[None] | None = None
        self._ends, self._ended = float("inf"), 0  # the next end of a lease, and how many have come

    def open(self) -> None:
        """Begin to listen for notifications, in the running event loop."""
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self.notifier.listen(), self._on_notification)
        self.relay.start()

    def close(self) -> None:
        """End every stream now. May be called from a signal handler or from another thread."""
        self.closed = True
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._wake_all)

    def end(self) -> None:
        """Stop listening, at the end of the application."""
        self.close()
        self.relay.close()
        if self._loop is not None:
            self._loop.remove_reader(self.notifier.listen())
        self.notifier.close()

    async def subscribe(
        self, run_id: int, after: int | None, stay: Stay | None = None
    ) -> AsyncIterator[ServerSentEvent]:
        """The events of a run, until its `stay` is over.

        `metrics` of the ticks after `after` are among them unless that is None.
        """
        question, leases, run = "", "[]", ""
        with self.joined(run_id) as subscription:
            subscription.streams += 1
            if subscription.seen is None:
                self._wake_watcher()
            try:
                while not (self.closed or subscription.gone or (stay and await stay.is_over())):
                    changed, seen = subscription.changed, subscription.seen
                    if seen is not None and seen.question != question:
                        question = seen.question
                        yield ServerSentEvent(event="question", raw_data=question)  # "null" is data too
                    if seen is not None and seen.leases != leases:
                        leases = seen.leases
                        yield ServerSentEvent(event="leases", raw_data=leases)
                    if subscription.run != run:
                        run = subscription.run
                        yield ServerSentEvent(event="run", raw_data=run)
                        async for event in self._metrics(run_id, subscription, after):
                            after = int(event.id or -1)
                            yield event
                    await (either(changed, stay.seconds) if stay else changed.wait())
            finally:
                subscription.streams -= 1

    async def _metrics(
        self, run_id: int, subscription: Subscription, after: int | None
    ) -> AsyncIterator[ServerSentEvent]:
        more = after is not None
        while more and after is not None:
            reading = subscription.rows.get(after)
            if reading is None:
                read = self.admission.read(told_metrics, self.db, run_id, after)
                reading = subscription.rows[after] = asyncio.ensure_future(read)
                asyncio.get_running_loop().call_later(POLL_SECONDS, subscription.rows.pop, after, None)
            try:
                rows = await asyncio.shield(reading)
            except StoreError:  # the next change of the run sends them
                return
            if rows.last is not None:
                after = rows.last
                yield ServerSentEvent(event="metrics", raw_data=rows.text, id=str(after))
            more = rows.more  # a run that is over does not change again

    async def wait_for(
        self,
        run_id: int,
        look: Callable[[], Awaitable[Found | None]],
        seconds: float,
        gone: Callable[[], Awaitable[bool]],
        sure: Callable[[], Awaitable[Found | None]] | None = None,
    ) -> Found | None:
        """Return what `look` finds now or within `seconds`; None if it finds nothing.

        It looks again when another question of the run may be leased; by `sure`, if that is given, where
        nobody else waits for it. It does not wait when as many requests wait already as streams are allowed.
        It stops once the client is `gone`: a question would be leased to nobody.
        """
        waiting = sum(one.requests for one in self.subscriptions.values())
        until = time.monotonic() + (seconds if waiting < self.limit else 0.0)
        with self.joined(run_id) as subscription:
            subscription.requests += 1
            seek = look
            try:
                while not await gone():
                    offered, again = subscription.offered, time.monotonic() + AGAIN_SECONDS
                    found = await seek()
                    if found is not None or time.monotonic() >= until or self.closed:
                        return found
                    while not offered.is_set() and time.monotonic() < min(until, again):
                        await either(offered, min(min(until, again) - time.monotonic(), GONE_SECONDS))
                        if not offered.is_set() and await gone():
                            return None
                    alone = offered.is_set() and subscription.requests == 1
                    seek = sure if sure is not None and alone else look
                return None
            finally:
                subscription.requests -= 1

    @contextmanager
    def joined(self, run_id: int) -> Iterator[Subscription]:
        """Have a run watched within the block."""
        subscription = self.subscriptions.setdefault(run_id, Subscription())
        subscription.holders += 1
        if self._watcher is None or self._watcher.done():
            self._watcher = asyncio.create_task(self._watch())
        try:
            yield subscription
        finally:
            subscription.holders -= 1
            if not subscription.holders:
                self.subscriptions.pop(run_id, None)
            if not self.subscriptions:
                self._wake_watcher()  # it ends where nothing is watched any more

    async def _watch(self) -> None:
        while self.subscriptions and not self.closed:
            news, cost = self._news, 0.0
            try:
                cost = await self._look()
                await self._read()
            except ServerError:  # busy or gone: the next look will tell
                cost = LONGEST_REST
            except Exception:
                log.exception("the runs that are followed could not be looked at")
                cost = LONGEST_REST
            self._tell()
            await asyncio.sleep(min(REST * cost, LONGEST_REST))
            await either(news, self._pause())

    async def _look(self) -> float:
        """Look at every run that is watched, unless nobody has committed since; return what that cost."""
        now, followed = time.monotonic(), [i for i, one in self.subscriptions.items() if one.streams]
        asked = [run_id for run_id in self.subscriptions if run_id not in set(followed)]
        self._ended += now >= self._ends
        signs = now // UNSURE_SECONDS if followed else 0.0
        key = ("watched", *followed, "asked", *asked, signs, self._ended)
        found: Look = await self.admission.read(self.db.cached, key, partial(look, self.db, followed, asked))
        self._ends = found.ends
        for run_id in (i for i in followed if i in self.subscriptions):
            self.subscriptions[run_id].take(found.runs.get(run_id), now)
        for run_id in (i for i in asked if i in self.subscriptions):
            self.subscriptions[run_id].take_offer(found.offers.get(run_id))
        return found.cost

    async def _read(self) -> None:
        """Read the runs that have changed and have streams, each at most once in `POLL_SECONDS`."""
        now = time.monotonic()
        due = {i: one for i, one in self.subscriptions.items() if one.streams and _ready(one) <= now}
        if not due:
            return
        for subscription in due.values():
            subscription.read = now
        texts = await self.admission.read(told_runs, self.db, list(due))
        for run_id, subscription in due.items():
            subscription.stale = False
            text = texts.get(run_id, subscription.run)
            if text != subscription.run:
                subscription.run, subscription.rows, subscription.untold = text, {}, True

    def _tell(self) -> None:
        """Wake the streams that have not been told, unless they were told of something just before."""
        now, seldom = time.monotonic(), self._seldom()
        for subscription in self.subscriptions.values():
            if subscription.untold and subscription.told + seldom <= now:
                subscription.tell()

    def _seldom(self) -> float:
        return min(STREAM_SECONDS * self.number(), SELDOM_SECONDS)

    def _pause(self) -> float:
        now = time.monotonic()
        streamed, seldom = [one for one in self.subscriptions.values() if one.streams], self._seldom()
        moments = [_ready(one) for one in streamed] + [one.told + seldom for one in streamed if one.untold]
        return min([POLL_SECONDS, self._ends - now, *(moment - now for moment in moments)])

    def _wake_watcher(self) -> None:
        self._news.set()
        self._news = asyncio.Event()

    def _on_notification(self) -> None:
        """Have who waits for a run's question ask for it at once; the watcher looks for everybody else."""
        news = self.notifier.drain()
        named = [one for one in map(self.subscriptions.get, news.runs) if one is not None]
        for one in named:
            one.offer()
        if news.others or any(one.streams for one in named):
            self._wake_watcher()

    def _wake_all(self) -> None:
        self._wake_watcher()
        for subscription in self.subscriptions.values():
            subscription.offer()
            subscription.tell()

    def number(self) -> int:
        """Return how many streams are open."""
        return sum(subscription.streams for subscription in list(self.subscriptions.values()))

    def check_room(self) -> None:
        """Refuse one stream too many.

        Raises:
            TooManyStreamsError: as many as allowed are open.
        """
        if self.number() >= self.limit:
            raise TooManyStreamsError


def _ready(subscription: Subscription) -> float:
    """Return when a run may be read; never where it has not changed."""
    return subscription.read + POLL_SECONDS if subscription.stale else float("inf")
