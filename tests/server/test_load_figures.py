"""The load of a web process at /metrics: connections, requests that wait, threads, and who was refused."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from typing import Any

import httpx2
import pytest

from parenting.server.admission import Admission
from parenting.server.db import Database
from parenting.server.errors import BusyError
from parenting.server.listener import bind
from parenting.server.serve import make_server
from parenting.server.settings import Settings
from tests.server.test_meters import figures

pytestmark = pytest.mark.only("sqlite", "nothing here asks the store")


@contextmanager
def served(settings: Settings) -> Iterator[int]:
    """A server in a thread; the block gets its port."""
    listener = bind(settings.model_copy(update={"port": 0}))
    server = make_server(settings)
    with ThreadPoolExecutor(1) as thread:
        ended = thread.submit(server.run, [listener])
        try:
            yield int(listener.getsockname()[1])
        finally:
            server.should_exit = True
        ended.result()


def test_connections_are_counted_with_those_that_were_refused(db: Database, settings: Settings) -> None:
    del db  # its tables are there now
    with (
        served(settings.model_copy(update={"connections": 3})) as port,
        httpx2.Client(base_url=f"http://localhost:{port}") as client,
        ExitStack() as opened,
    ):
        for _ in range(4):
            opened.enter_context(socket.create_connection(("127.0.0.1", port)))
        found = figures(client)
        assert found["parenting_connections_open", ()] == 3
        assert found["parenting_connections_ended_total", ()] == 2, "the fourth one, and the client's own"
        codes = ("too_many", "too_large", "too_slow", "invalid")
        assert [found["parenting_connections_refused_total", (code,)] for code in codes] == [0, 0, 0, 0]
        bad = opened.enter_context(socket.create_connection(("127.0.0.1", port)))
        bad.sendall(b"nonsense\r\n\r\n")
        assert b" 400 " in bad.recv(1000)
        found = figures(client)
        assert [found["parenting_connections_refused_total", (code,)] for code in codes] == [0, 0, 0, 1]


def test_waiting_requests_and_busy_threads_are_told_by_kind(client: httpx2.Client) -> None:
    async def fill(admission: Admission) -> None:
        async with admission.writing.entered(9), admission.reading.entered(9):
            waiting = asyncio.ensure_future(one_more(admission))
            await asyncio.sleep(0)
            with pytest.raises(BusyError):
                await one_more(admission)
            seen.append(await asyncio.to_thread(figures, client))
        await waiting

    async def one_more(admission: Admission) -> None:
        async with admission.writing.entered(9):
            pass

    seen: list[dict[tuple[str, tuple[str, ...]], float]] = []
    app: Any = client._transport.app  # type: ignore[attr-defined]  # the test's client holds the application
    app.state.admission = Admission(writers=1, readers=5, waiting=1)
    with ThreadPoolExecutor(1) as thread:
        thread.submit(asyncio.run, fill(app.state.admission)).result()
    for name, kind, number in (
        ("parenting_requests_waiting", "write", 1),
        ("parenting_requests_waiting", "read", 0),
        ("parenting_threads_busy", "write", 1),
        ("parenting_threads_busy", "read", 1),
    ):
        assert seen[0][name, (kind,)] == number, (name, kind)
    assert seen[0]["parenting_admission_refused_total", ("write", "full")] == 1
    assert seen[0]["parenting_admission_refused_total", ("write", "late")] == 0
    assert figures(client)["parenting_threads_busy", ("write",)] == 0
