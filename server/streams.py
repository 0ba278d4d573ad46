"""Live streams: browsers follow a run by server-sent events.

However many browsers follow a run, one task polls the database for it, four times a second and after each
notification of the worker. A question is sent without delay, everything else at most once in 250 ms. Streams
end at once when the server stops.
"""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

from fastapi.sse import ServerSentEvent

from parenting.server.admission import Admission
from parenting.server.db import Database
from parenting.server.errors import NotFound, ServerError, StoreError, TooManyStreamsError
from parenting.server.notify import Notifier
from parenting.server.queue.leases import waiting
from parenting.server.queue.presence import held
from parenting.server.reads.metrics import list_metrics
from parenting.server.reads.schemas import metric_schemas, run_schema
from parenting.server.store.relay import Relay

POLL_SECONDS = 0.25
"""Seconds between polls, and at least between two events of the same browser, questions excepted."""
YIELD_SECONDS = 0.1
"""After a notification, streams wait this many seconds so that requests for a question are served first."""

Found = TypeVar("Found")
Seen = tuple[dict[str, Any], dict[str, Any] | None, list[dict[str, str]]]

ROWS = 10_000
"""Metrics in one event, at most."""


@dataclass
class Subscription:
    """The last known state of one run, shared by every stream of it."""

    streams: int = 0
    run: dict[str, Any] = field(default_factory=dict)
    question: dict[str, Any] | None = None
    leases: list[dict[str, str]] = field(default_factory=list)
    changed: asyncio.Event = field(default_factory=asyncio.Event)
    task: asyncio.Task[None] | None = None
    gone: bool = False  # the run was deleted


class Streams:
    """All live streams of this process."""

    def __init__(self, db: Database, notifier: Notifier, limit: int, admission: Admission) -> None:
        self.db, self.notifier, self.limit, self.admission = db, notifier, limit, admission
        self.subscriptions: dict[int, Subscription] = {}
        self.relay = Relay(db.engine, "web", notifier.wake)
        self.closed = False
        self.waiting_requests = 0  # requests for a question that lie here
        self._notified = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None

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

    async def subscribe(self, run_id: int, after: int | None) -> AsyncIterator[ServerSentEvent]:
        """The events of a run; `metrics` of the ticks after `after` are among them unless that is None."""
        subscription = self._join(run_id)
        try:
            seen: dict[str, Any] = {}
            asked: Any = ...
            leases: Any = []
            ready = 0.0
            while not self.closed and not subscription.gone:
                changed = subscription.changed
                if subscription.run and subscription.question != asked:
                    asked = subscription.question
                    yield ServerSentEvent(event="question", raw_data=json.dumps(asked))  # "null" is data too
                if subscription.leases != leases:
                    leases = subscription.leases
                    yield ServerSentEvent(event="leases", raw_data=json.dumps(leases))
                now = asyncio.get_running_loop().time()
                if subscription.run != seen and now >= ready:
                    seen, ready = subscription.run, now + POLL_SECONDS
                    yield ServerSentEvent(event="run", data=seen)
                    async for event in self._metrics(run_id, after):
                        after = int(event.id or -1)
                        yield event
                await either(changed, ready - now if subscription.run != seen else None)
        finally:
            self._leave(run_id, subscription)

    async def _metrics(self, run_id: int, after: int | None) -> AsyncIterator[ServerSentEvent]:
        while after is not None:
            try:
                rows = await self.admission.read(list_metrics, self.db, run_id, after, ROWS)
            except StoreError:  # the next change of the run sends them
                return
            shown = [row.model_dump(mode="json") for row in metric_schemas(rows)]
            ticks = [row["tick"] for row in shown if row["tick"] is not None]
            if ticks:
                yield ServerSentEvent(event="metrics", data={"rows": shown}, id=str(ticks[-1]))
            # there may be more: a run that is over stays so
            after = ticks[-1] if ticks and len(rows) == ROWS else None

    async def wait_for(
        self, look: Callable[[], Found | None], seconds: float, gone: Callable[[], Awaitable[bool]]
    ) -> Found | None:
        """Return what `look` finds now or within `seconds`; None if it finds nothing.

        It looks again after each notification and every `POLL_SECONDS`. It does not wait when as many
        requests wait already as streams are allowed. It stops looking once the client is `gone`: a question
        would be leased to nobody.
        """
        until = time.monotonic() + (seconds if self.waiting_requests < self.limit else 0.0)
        self.waiting_requests += 1
        try:
            while not await gone():
                notified = self._notified
                found = await self.admission.write(look)
                left = until - time.monotonic()
                if found is not None or left <= 0 or self.closed:
                    return found
                await either(notified, min(left, POLL_SECONDS))
            return None
        finally:
            self.waiting_requests -= 1

    def _join(self, run_id: int) -> Subscription:
        subscription = self.subscriptions.setdefault(run_id, Subscription())
        subscription.streams += 1
        if subscription.task is None:
            subscription.task = asyncio.create_task(self._watch(run_id, subscription))
        return subscription

    def _leave(self, run_id: int, subscription: Subscription) -> None:
        subscription.streams -= 1
        if not subscription.streams and subscription.task is not None:
            subscription.task.cancel()
            del self.subscriptions[run_id]

    async def _watch(self, run_id: int, subscription: Subscription) -> None:
        while not self.closed:
            notified = self._notified
            look = partial(_look, self.db, run_id)
            ends_in: float | None = None
            try:
                now, ends_in = await self.admission.read(look)
            except NotFound:
                subscription.gone = True  # its streams end, and whoever opens one again gets 404
                _tell(subscription)
                return
            except ServerError:  # busy: the next look will tell
                now = subscription.run, subscription.question, subscription.leases
            if now != (subscription.run, subscription.question, subscription.leases):
                subscription.run, subscription.question, subscription.leases = now
                _tell(subscription)
            # nobody notifies of the end of a lease
            await either(notified, POLL_SECONDS if ends_in is None else min(POLL_SECONDS, ends_in))
            if notified.is_set() and self.waiting_requests:
                await asyncio.sleep(YIELD_SECONDS)

    def news(self) -> asyncio.Event:
        """Return what the next notification sets; take it before the look that it is to repeat."""
        return self._notified

    def _on_notification(self) -> None:
        self.notifier.drain()
        self._notified.set()
        self._notified = asyncio.Event()

    def _wake_all(self) -> None:
        self._notified.set()
        for subscription in self.subscriptions.values():
            _tell(subscription)

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


def _tell(subscription: Subscription) -> None:
    subscription.changed.set()
    subscription.changed = asyncio.Event()


def _look(db: Database, run_id: int) -> tuple[Seen, float | None]:
    """The run, its most urgent open question, and its leases; then the seconds until one of them ends."""
    query = waiting(db, run_id)
    question = None if query is None else {"id": query.id, "public_id": query.public_id, "kind": query.kind}
    leases = held(db, run_id)
    return (run_schema(db, run_id).model_dump(mode="json"), question, leases.leases), leases.ends_in


async def either(event: asyncio.Event, timeout: float | None) -> None:
    """Wait for an event, or for so many seconds; None waits for the event alone."""
    try:
        await asyncio.wait_for(event.wait(), None if timeout is None else max(timeout, 0.0))
    except TimeoutError:
        return
