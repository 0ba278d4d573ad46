"""Admission: requests wait for the store in the event loop, in a queue of bounded length, before a thread.

A verb blocks a thread while the store is locked. Without a bound, two hundred waiting answers would take
every thread, and nobody could read a page. So at most `WRITERS` requests that write and `READERS` that read
have a thread at a time. Others wait without one, for five seconds in all (`server.store.patience`), and where
`WAITING` wait already, the next is refused at once. A refusal is 503 with Retry-After: clients send again.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from functools import partial
from inspect import isasyncgenfunction, iscoroutinefunction
from typing import Any, TypeVar

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool

from parenting.server.access.guard import GuardedRoute
from parenting.server.errors import BusyError
from parenting.server.store.patience import patience, remaining
from parenting.server.store.sqlite import BUSY_SECONDS
from parenting.server.strict import strictly

Found = TypeVar("Found")
Handler = Callable[[Request], Coroutine[Any, Any, Response]]

WRITERS = 8
"""Requests that write and have a thread. The store takes one write at a time (SQLite) or a few."""
READERS = 24
"""Requests that read and have a thread; together with the writers fewer than the pool's forty."""
WAITING = 256
"""Requests of one kind that wait for a thread."""
READING = ("GET", "HEAD", "OPTIONS")


class Gate:
    """Some places, and a queue before them."""

    def __init__(self, places: int, waiting: int) -> None:
        self._free = asyncio.Semaphore(places)
        self._most, self.waiting, self.busy = waiting, 0, 0
        self.refused = Counter({"full": 0, "late": 0})
        """Requests that were refused because the queue was full, or because no place was free in time."""

    @asynccontextmanager
    async def entered(self, seconds: float) -> AsyncIterator[None]:
        """Hold a place within the block, and pass on what is left of `seconds` as its patience.

        Raises:
            BusyError: the queue is full, or no place was free in time.
        """
        if self._free.locked() and self.waiting >= self._most:
            self.refused["full"] += 1
            raise BusyError("Too many requests wait for the database; nothing was stored. Send it again.")
        with patience(seconds):
            self.waiting += 1
            try:
                await asyncio.wait_for(self._free.acquire(), remaining(seconds))
            except TimeoutError:
                self.refused["late"] += 1
                raise BusyError from None
            finally:
                self.waiting -= 1
            self.busy += 1
            try:
                yield
            finally:
                self.busy -= 1
                self._free.release()


class Admission:
    """The gates of one web process: one for requests that write, one for those that read."""

    def __init__(
        self,
        writers: int = WRITERS,
        readers: int = READERS,
        waiting: int = WAITING,
        seconds: float = BUSY_SECONDS,
    ) -> None:
        self.writing, self.reading = Gate(writers, waiting), Gate(readers, waiting)
        self.seconds = seconds

    def gate(self, method: str) -> Gate:
        """Return the gate of an HTTP method."""
        return self.reading if method in READING else self.writing

    async def write(self, verb: Callable[..., Found], *arguments: Any) -> Found:
        """Run a verb that may write in a thread, once there is a place. For routes that are coroutines.

        Raises:
            BusyError: no place in time.
        """
        async with self.writing.entered(self.seconds):
            return await run_in_threadpool(partial(verb, *arguments))

    async def read(self, verb: Callable[..., Found], *arguments: Any) -> Found:
        """Run a verb that reads in a thread, as `write` does."""
        async with self.reading.entered(self.seconds):
            return await run_in_threadpool(partial(verb, *arguments))


class AdmittedRoute(GuardedRoute):
    """A route whose function blocks: its request is admitted before it gets a thread.

    A route that is a coroutine has no thread of its own; it asks `Admission` for each verb.
    """

    def get_route_handler(self) -> Handler:
        """Return the handler, behind the gate where the function blocks."""
        handle = self.get_handler()
        if iscoroutinefunction(self.endpoint) or isasyncgenfunction(self.endpoint):
            return self.guarded(strictly(self.dependant, handle))

        async def admitted(request: Request) -> Response:
            await request.body()  # first: a slow sender holds no place
            admission: Admission = request.app.state.admission
            async with admission.gate(request.method).entered(admission.seconds):
                return await handle(request)

        return self.guarded(strictly(self.dependant, admitted))


def admitted_router(**options: Any) -> APIRouter:
    """Make a router of such routes."""
    return APIRouter(route_class=AdmittedRoute, **options)
