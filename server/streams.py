"""Live streams: what a run does, told to the browsers that look at it, by server-sent events.

One watcher a run polls the database four times a second, however many browsers look, and at once when the
worker rings. A question is told without delay; everything else at most once in 250 ms. Streams end at once
when the server stops.
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
from starlette.concurrency import run_in_threadpool

from parenting.server.db import Database
from parenting.server.errors import ServerError, TooMany
from parenting.server.queue.parent_side import waiting
from parenting.server.record import metrics
from parenting.server.schemas import metric_schemas, run_schema
from parenting.server.wake import Bell

PERIOD = 0.25
"""Seconds between polls, and at least between two events of the same browser, questions excepted."""
COURTESY = 0.1
"""Seconds after a ring for which the streams let those go first who wait for a question."""

Found = TypeVar("Found")

ROWS = 10_000
"""Metrics in one event, at most."""


@dataclass
class Watcher:
    """What is known of one run, and who wants to hear of it."""

    streams: int = 0
    run: dict[str, Any] = field(default_factory=dict)
    question: dict[str, Any] | None = None
    changed: asyncio.Event = field(default_factory=asyncio.Event)
    task: asyncio.Task[None] | None = None


class Streams:
    """All live streams of this process."""

    def __init__(self, db: Database, bell: Bell, limit: int) -> None:
        self.db, self.bell, self.limit = db, bell, limit
        self.watchers: dict[int, Watcher] = {}
        self.closed = False
        self._askers = 0
        self._rung = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None

    def open(self) -> None:
        """Begin to listen for the bell, in the running event loop."""
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self.bell.listen(), self._on_ring)

    def close(self) -> None:
        """End every stream now. May be called from a signal handler or from another thread."""
        self.closed = True
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._wake_all)

    def end(self) -> None:
        """Stop listening, at the end of the application."""
        self.close()
        if self._loop is not None:
            self._loop.remove_reader(self.bell.listen())
        self.bell.close()

    async def follow(self, run_id: int, after: int | None) -> AsyncIterator[ServerSentEvent]:
        """The events of a run: `run`, `question`, and, unless `after` is None, `metrics` of later ticks."""
        watcher = self._join(run_id)
        try:
            seen: dict[str, Any] = {}
            asked: Any = ...
            ready = 0.0
            while not self.closed:
                changed = watcher.changed
                if watcher.run and watcher.question != asked:
                    asked = watcher.question
                    yield ServerSentEvent(event="question", raw_data=json.dumps(asked))  # "null" is data too
                now = asyncio.get_running_loop().time()
                if watcher.run != seen and now >= ready:
                    seen, ready = watcher.run, now + PERIOD
                    yield ServerSentEvent(event="run", data=seen)
                    async for event in self._metrics(run_id, after):
                        after = int(event.id or -1)
                        yield event
                await _either(changed, ready - now if watcher.run != seen else None)
        finally:
            self._leave(run_id, watcher)

    async def _metrics(self, run_id: int, after: int | None) -> AsyncIterator[ServerSentEvent]:
        while after is not None:
            rows = await run_in_threadpool(metrics, self.db, run_id, after, ROWS)
            if rows:
                shown = [row.model_dump(mode="json") for row in metric_schemas(rows)]
                yield ServerSentEvent(event="metrics", data={"rows": shown}, id=str(rows[-1].tick))
            after = (
                rows[-1].tick if len(rows) == ROWS else None
            )  # there may be more: a run that is over stays so

    async def first(
        self, look: Callable[[], Found | None], seconds: float, gone: Callable[[], Awaitable[bool]]
    ) -> Found | None:
        """What a look finds, now or within `seconds`; it looks again at every ring, and now and then.

        Where as many wait already as streams are allowed, it does not wait. Once who asked is `gone`, it does
        not look: a question would be held for nobody.
        """
        until = time.monotonic() + (seconds if self._askers < self.limit else 0.0)
        self._askers += 1
        try:
            while not await gone():
                rung = self._rung
                found = await run_in_threadpool(look)
                left = until - time.monotonic()
                if found is not None or left <= 0 or self.closed:
                    return found
                await _either(rung, min(left, PERIOD))
            return None
        finally:
            self._askers -= 1

    def _join(self, run_id: int) -> Watcher:
        watcher = self.watchers.setdefault(run_id, Watcher())
        watcher.streams += 1
        if watcher.task is None:
            watcher.task = asyncio.create_task(self._watch(run_id, watcher))
        return watcher

    def _leave(self, run_id: int, watcher: Watcher) -> None:
        watcher.streams -= 1
        if not watcher.streams and watcher.task is not None:
            watcher.task.cancel()
            del self.watchers[run_id]

    async def _watch(self, run_id: int, watcher: Watcher) -> None:
        while not self.closed:
            rung = self._rung
            look = partial(_look, self.db, run_id)
            try:
                run, question = await run_in_threadpool(look)
            except ServerError:  # busy: the next look will tell
                run, question = watcher.run, watcher.question
            if (run, question) != (watcher.run, watcher.question):
                watcher.run, watcher.question = run, question
                _tell(watcher)
            await _either(rung, PERIOD)
            if rung.is_set() and self._askers:
                await asyncio.sleep(COURTESY)

    def _on_ring(self) -> None:
        self.bell.drain()
        self._rung.set()
        self._rung = asyncio.Event()

    def _wake_all(self) -> None:
        self._rung.set()
        for watcher in self.watchers.values():
            _tell(watcher)

    def check_room(self) -> None:
        """Refuse one stream too many.

        Raises:
            TooMany: as many as allowed are open.
        """
        if sum(watcher.streams for watcher in self.watchers.values()) >= self.limit:
            raise TooMany


def _tell(watcher: Watcher) -> None:
    watcher.changed.set()
    watcher.changed = asyncio.Event()


def _look(db: Database, run_id: int) -> tuple[dict[str, Any], dict[str, Any] | None]:
    """The run, and the most urgent open question, in few words."""
    query = waiting(db, run_id)
    question = None if query is None else {"id": query.id, "kind": query.kind}
    return run_schema(db, run_id).model_dump(mode="json"), question


async def _either(event: asyncio.Event, timeout: float | None) -> None:
    try:
        await asyncio.wait_for(event.wait(), None if timeout is None else max(timeout, 0.0))
    except TimeoutError:
        return
