"""Floods of a real web process: huge heads, more idle connections than files, raw bytes (E8, E12)."""

import contextlib
import os
import random
import re
import resource
import selectors
import signal
import socket
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from parenting.server.db import connect
from parenting.server.migrate import upgrade
from parenting.server.settings import Settings
from tests.access import bearer, seed
from tests.faults.seeds import draws
from tests.lengths import length
from tests.server.serving import free_port, until_up
from tests.tree import ROOT

FILES = 1024
GET = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
START = b'{"world": "unsafe-exploration", "name": "Zo\xc3\xab", "seed": 7}'
SEEDS = (
    b"GET /api/v1/runs?limit=5 HTTP/1.1\r\nPROOF\r\nHost: localhost\r\nCookie: a=b; c\r\n"
    b"Accept: text/html\r\n\r\n",
    b"GET /runs/1/parent HTTP/1.1\r\nPROOF\r\nHost: localhost:8765\r\nIf-None-Match: x\r\n\r\n",
    b"GET /static/site.css HTTP/1.1\r\nPROOF\r\nHost: localhost\r\nRange: bytes=0-5\r\n\r\n",
    b"POST /api/v1/runs/1/goal HTTP/1.1\r\nPROOF\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    b'Content-Length: 11\r\n\r\n{"goal": 5}',
    b"POST /api/v1/runs/1/queries/lease HTTP/1.1\r\nPROOF\r\nHost: localhost\r\n"
    b"Content-Type: application/json\r\n"
    b'Transfer-Encoding: chunked\r\n\r\n12\r\n{"client_id": "a"}\r\n0\r\n\r\n',
    b"POST /runs HTTP/1.1\r\nPROOF\r\nHost: localhost\r\nContent-Type: application/x-www-form-urlencoded\r\n"
    b"Content-Length: 33\r\n\r\nworld=unsafe-exploration&seed=%31%",
)
"""Requests of the researcher: `Web.known` puts the header Authorization into them."""
PIECES = (
    b"\x00",
    b"\r\n",
    b"\n",
    b"%",
    b"%ff",
    b"\xed\xa0\x80",
    b"NaN",
    b"1e400",
    b"-1",
    b"9" * 400,
    b"[" * 999,
)
MORE = (
    b"\xff\xfe",
    b'"\\ud800"',
    b"../",
    b";",
    b"Host: x\r\n",
    b"Content-Length: 5\r\n",
    b"chunked",
    b" " * 99,
)


class Web:
    """A web process with the usual limit of files."""

    def __init__(self, data: Path) -> None:
        db = connect(Settings(data=data, database_url=None))
        upgrade(db)
        db.close()
        seed(data)
        self.port = free_port()
        code = (
            f"import resource; resource.setrlimit(resource.RLIMIT_NOFILE, ({FILES}, {FILES}));"
            "from parenting.commands.main import app; app()"
        )
        environment = {**os.environ, "PARENTING_DATA": str(data), "PYTHONPATH": str(ROOT)}
        environment.pop("PARENTING_DATABASE_URL", None)
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", code, "web", "--port", str(self.port)], env=environment, cwd=data
        )
        until_up(f"http://127.0.0.1:{self.port}")

    def known(self, request: bytes) -> bytes:
        """A request with the header by which it is let in."""
        return request.replace(b"PROOF", f"Authorization: {bearer(self.port)}".encode())

    def connect(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), timeout=10)

    def ask(self, request: bytes) -> bytes:
        """All that is replied, until the server closes."""
        with self.connect() as connection:
            connection.sendall(request)
            return read(connection)

    def is_alive(self) -> bool:
        return self.ask(GET).startswith(b"HTTP/1.1 200") and self.process.poll() is None

    def megabytes(self) -> float:
        """The memory of the process."""
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * resource.getpagesize() / 1e6


@pytest.fixture(scope="module")
def web(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Web]:
    one = Web(tmp_path_factory.mktemp("flooded"))
    try:
        yield one
    finally:
        one.process.terminate()
        assert one.process.wait(10) in (0, -signal.SIGTERM)


def read(connection: socket.socket) -> bytes:
    parts = []
    with contextlib.suppress(ConnectionResetError, BrokenPipeError, TimeoutError):
        while part := connection.recv(65536):
            parts.append(part)
    return b"".join(parts)


def test_heads_of_50_mb_cost_no_memory_and_hold_nobody_up(web: Web) -> None:
    before = web.megabytes()

    def flood() -> None:
        with web.connect() as connection, contextlib.suppress(OSError):
            connection.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nX: ")
            for _ in range(800):
                connection.sendall(b"a" * 65536)

    floods = [threading.Thread(target=flood) for _ in range(10)]
    for one in floods:
        one.start()
    assert web.is_alive()
    for one in floods:
        one.join()
    assert web.is_alive()
    assert web.megabytes() - before < 30


def test_more_idle_connections_than_files_keep_nobody_out(web: Web) -> None:
    with contextlib.ExitStack() as stack:
        for number in range(1100):
            stack.enter_context(web.connect())
            if number % 100 == 0:
                assert web.is_alive()
        for _ in range(20):
            assert web.is_alive()


@pytest.mark.torture
@pytest.mark.timeout(length(1800, 3600))
def test_mutated_bytes_get_no_5xx_and_hurt_nobody(web: Web) -> None:
    """It takes half a minute: 20,000 mutations, each on a connection of its own."""
    draw = draws("mutated bytes")
    started = web.known(
        b"POST /api/v1/runs HTTP/1.1\r\nPROOF\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    )
    made = web.ask(started + b"Connection: close\r\nContent-Length: %d\r\n\r\n" % len(START) + START)
    assert b" 201 " in made.splitlines()[0]
    before, statuses = web.megabytes(), Counter[bytes]()
    for _ in range(length(20_000, 200_000) // 500):
        sent = [mutated(draw, web) for _ in range(500)]
        for request, reply in zip(sent, exchanged(web, sent), strict=True):
            found = re.findall(rb"HTTP/1\.1 (\d)", reply)
            statuses.update(found)
            assert b"5" not in found, (request, reply)
    assert min(statuses[b"2"], statuses[b"4"]) > 1000, statuses
    assert web.is_alive()
    assert web.megabytes() - before < 60
    assert b"Zo" in web.ask(
        web.known(b"GET /api/v1/runs/1 HTTP/1.1\r\nPROOF\r\nHost: localhost\r\nConnection: close\r\n\r\n")
    )


def exchanged(web: Web, sent: Sequence[bytes]) -> list[bytes]:
    """The replies on as many connections at once, until all are closed or nothing comes any more.

    Nothing comes any more if it is silent before and after the server has answered somebody else: a busy one
    is only slow.
    """
    replies = [b""] * len(sent)
    with contextlib.ExitStack() as stack, selectors.DefaultSelector() as selector:
        for number, request in enumerate(sent):
            connection = stack.enter_context(web.connect())
            with contextlib.suppress(OSError):
                connection.sendall(request + GET)
            selector.register(connection, selectors.EVENT_READ, number)
        silent = False
        while selector.get_map():
            ready = selector.select(0.1)
            if not ready and silent:
                break
            silent = not ready and web.is_alive()
            for key, _ in ready:
                part = b""
                with contextlib.suppress(OSError):
                    part = key.fileobj.recv(65536)  # type: ignore[union-attr]
                replies[key.data] += part
                if not part:
                    selector.unregister(key.fileobj)
    return replies


def mutated(draw: random.Random, web: Web) -> bytes:
    """A request with one to four bytes or pieces changed, dropped, doubled or put in."""
    request = bytearray(web.known(draw.choice(SEEDS)))
    for _ in range(draw.choice((1, 1, 2, 4))):
        at = draw.randrange(len(request) + 1)
        kind = draw.randrange(5)
        if kind == 0:
            request[at : at + 1] = bytes([draw.randrange(256)])
        elif kind == 1:
            del request[at : at + draw.choice((1, 2, 20))]
        elif kind == 2:
            request[at:at] = draw.choice(PIECES + MORE)
        elif kind == 3:
            request[at:at] = request[at : at + draw.choice((1, 10, 100))]
        else:
            request[at : at + 1] = bytes(
                [(request[at] if at < len(request) else 0) ^ (1 << draw.randrange(8))]
            )
    return bytes(request)
