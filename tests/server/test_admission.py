"""While the store is locked: who waits, who does not, and what those who wait are told (D2, E8)."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, contextmanager
from typing import Any

import httpx2
import pytest
from fastapi import FastAPI

from parenting.server.admission import Admission, Gate
from parenting.server.app import create_app
from parenting.server.db import Database, connect
from parenting.server.errors import BusyError
from parenting.server.settings import Settings
from parenting.server.streams import Streams
from parenting.server.workers import sign

pytestmark = pytest.mark.only("sqlite", "the lock of the one file")

LONG, SHORT = 120.0, 0.5
"""Bounds of a request in these tests, in seconds; five in production. A busy machine reads slowly."""


@contextmanager
def locked(settings: Settings) -> Iterator[None]:
    """Another program holds the write lock."""
    other = connect(settings)
    with other.write():
        yield
    other.close()


@asynccontextmanager
async def serving(app: FastAPI, admission: Admission) -> AsyncIterator[httpx2.AsyncClient]:
    """A client of the application, which admits as the test wants."""
    streams: Streams = app.state.streams
    app.state.admission = streams.admission = admission
    transport = httpx2.ASGITransport(app=app)
    async with (
        app.router.lifespan_context(app),
        httpx2.AsyncClient(transport=transport, base_url="http://localhost:8765", timeout=30) as client,
    ):
        yield client


def answering(client: httpx2.AsyncClient, guidance: int) -> Awaitable[httpx2.Response]:
    body = {"choice": "left", "client_id": "ann"}
    return client.post(f"/api/v1/queries/{guidance}/answer", json=body)


def in_loop(
    test: Callable[[httpx2.AsyncClient], Awaitable[None]],
    settings: Settings,
    db: Database,
    bound: float = LONG,
) -> None:
    async def whole() -> None:
        async with serving(create_app(settings, db), Admission(seconds=bound)) as client:
            await test(client)

    in_a_loop(whole())


@pytest.mark.slow
def test_two_hundred_waiting_answers_hold_up_nobody_who_reads(
    settings: Settings, db: Database, guidance: int
) -> None:
    async def test(client: httpx2.AsyncClient) -> None:
        sign(db, "worker-1")
        with locked(settings):
            answers = [asyncio.ensure_future(answering(client, guidance)) for _ in range(200)]
            await asyncio.sleep(0.1)  # all of them have arrived
            for path in ("/healthz", "/", "/static/site.css", "/api/v1/runs", "/readyz"):
                reply = await client.get(path)
                assert reply.status_code == (503 if path == "/readyz" else 200), path
                assert not any(answer.done() for answer in answers), f"{path} waited for the store"
            assert "store: busy" in reply.json()["error"]["message"]
        assert {reply.status_code for reply in await asyncio.gather(*answers)} == {200}
        assert (await client.get("/readyz")).status_code == 200

    in_loop(test, settings, db)


def test_answers_that_wait_too_long_are_refused_with_a_time_to_come_again(
    settings: Settings, db: Database, guidance: int
) -> None:
    async def test(client: httpx2.AsyncClient) -> None:
        with locked(settings):
            replies = await asyncio.gather(*[answering(client, guidance) for _ in range(9)])
        assert {reply.status_code for reply in replies} == {503}
        assert {reply.headers["Retry-After"] for reply in replies} == {"1"}
        assert {reply.json()["error"]["code"] for reply in replies} == {"busy"}

    in_loop(test, settings, db, SHORT)


def test_answers_that_wait_are_stored_once_the_lock_is_gone(
    settings: Settings, db: Database, guidance: int
) -> None:
    async def test(client: httpx2.AsyncClient) -> None:
        with locked(settings):
            waiting = asyncio.ensure_future(answering(client, guidance))
            await asyncio.sleep(0.25)
            assert not waiting.done()
        assert (await waiting).status_code == 200

    in_loop(test, settings, db)


def test_full_queue_refuses_at_once() -> None:
    async def test() -> None:
        gate = Gate(places=1, waiting=1)
        async with gate.entered(5):
            second = asyncio.ensure_future(_enter(gate))
            await asyncio.sleep(0)
            assert (gate.busy, gate.waiting) == (1, 1)
            with pytest.raises(BusyError, match="Too many requests wait"):
                await _enter(gate)
            assert not second.done()
        await second
        assert (gate.busy, gate.waiting) == (0, 0)
        assert gate.refused == {"full": 1, "late": 0}
        await _enter(gate)  # the place was given back

    in_a_loop(test())


def test_place_that_stays_taken_is_busy() -> None:
    async def test() -> None:
        gate = Gate(places=1, waiting=9)
        async with gate.entered(5):
            with pytest.raises(BusyError):
                await _enter(gate, 0.01)
        await _enter(gate)
        assert gate.refused == {"full": 0, "late": 1}

    in_a_loop(test())


def in_a_loop(test: Coroutine[Any, Any, None]) -> None:
    """Run a coroutine in a thread: a browser that another test left open has a loop in this one."""
    with ThreadPoolExecutor(1) as thread:
        thread.submit(asyncio.run, test).result()


async def _enter(gate: Gate, seconds: float = 5) -> None:
    async with gate.entered(seconds):
        return
