"""Plain sockets against uvicorn with our protocol: heads, bodies, deadlines and connections (E8, E12)."""

import asyncio
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import replace

import pytest
import uvicorn
from starlette.types import Receive, Scope, Send

from parenting.server.connections.limits import Limits
from parenting.server.connections.protocol import bounded

SHORT = Limits(connections=20, head_seconds=0.4, body_seconds=0.4, unread_seconds=0.4, linger_seconds=0.2)
FINE = b"\r\nfine\r\n0\r\n\r\n"
GET = b"GET / HTTP/1.1\r\nHost: localhost\r\n"


async def application(scope: Scope, receive: Receive, send: Send) -> None:
    """Paths send for a second, 50 MB in parts, 20 MB at once, or before the body; others echo."""
    body, path = b"", scope["path"]
    while path != "/early":
        message = await receive()
        if message["type"] == "http.disconnect":
            return
        body += message.get("body", b"")
        if not message.get("more_body"):
            break
    body = b"x" * 20_000_000 if path == "/whole" else body
    part, times = {"/large": (b"x" * 65_536, 800), "/stream": (b"x", 10)}.get(path, (b"", 0))
    await send({"type": "http.response.start", "status": 200, "headers": []})
    for _ in range(times):
        await send({"type": "http.response.body", "body": part, "more_body": True})
        await asyncio.sleep(0.1 if path == "/stream" else 0)
    await send({"type": "http.response.body", "body": body or b"fine"})


@contextmanager
def serving(limits: Limits) -> Iterator[Callable[[], socket.socket]]:
    """A server on loopback; yields a function that connects to it."""
    config = uvicorn.Config(
        application, http=bounded(limits), ws="none", lifespan="off", log_config=None, timeout_keep_alive=5
    )
    server = uvicorn.Server(config)
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen(128)
        thread = threading.Thread(target=lambda: asyncio.run(server.serve(sockets=[listener])), daemon=True)
        thread.start()
        address = listener.getsockname()
        yield lambda: socket.create_connection(address, timeout=10)
        server.should_exit = server.force_exit = True
        thread.join(10)
        assert not thread.is_alive()


@pytest.fixture(scope="module")
def connect() -> Iterator[Callable[[], socket.socket]]:
    with serving(SHORT) as connecting:
        yield connecting


def told(client: socket.socket) -> bytes:
    """Everything up to the end of the connection."""
    parts = []
    try:
        while part := client.recv(65_536):
            parts.append(part)
    except ConnectionResetError:
        pass
    return b"".join(parts)


def asked(connect: Callable[[], socket.socket], *parts: bytes) -> bytes:
    with closing(connect()) as client:
        for part in parts:
            try:
                client.sendall(part)
            except (BrokenPipeError, ConnectionResetError):
                break
        return told(client)


def sent_until_cut_off(client: socket.socket, part: bytes, times: int, pause: float) -> int:
    """The number of times it could be sent before the connection ended; `times` if it never did."""
    for number in range(times):
        try:
            client.sendall(part)
        except (BrokenPipeError, ConnectionResetError):
            return number
        time.sleep(pause)
    return times


def status(reply: bytes) -> int:
    return int(reply.split(b" ", 2)[1])


def test_usual_request_is_answered(connect: Callable[[], socket.socket]) -> None:
    assert asked(connect, GET + b"Connection: close\r\n\r\n").endswith(FINE)


def test_requests_of_one_connection_are_answered_in_turn(connect: Callable[[], socket.socket]) -> None:
    reply = asked(connect, 3 * (GET + b"\r\n"), GET + b"Connection: close\r\n\r\n")
    assert reply.count(b"200 OK") == 4


def test_head_in_pieces_is_one_head(connect: Callable[[], socket.socket]) -> None:
    whole = GET + b"Connection: close\r\n\r\n"
    with closing(connect()) as client:
        for place in range(len(whole)):
            client.sendall(whole[place : place + 1])
        assert told(client).endswith(FINE)


@pytest.mark.parametrize(
    "head",
    [
        GET + b"X: " + b"x" * 20_000,
        b"GET /" + b"x" * 20_000,
        GET + b"".join(b"X%d: %s\r\n" % (n, b"x" * 900) for n in range(20)),
        GET + b"X: 1\r\n" * 101 + b"\r\n",
        GET + b"X: " + b"x" * 20_000 + b"\r\n\r\n",
    ],
    ids=["a long header", "a long address", "long headers", "many headers", "a whole long head"],
)
def test_head_that_is_too_large_is_refused(connect: Callable[[], socket.socket], head: bytes) -> None:
    reply = asked(connect, head)
    assert status(reply) == 431
    assert b'{"error": {"code": "too_large"' in reply


def test_fifty_megabytes_of_head_are_not_read(connect: Callable[[], socket.socket]) -> None:
    with closing(connect()) as client:
        client.sendall(GET + b"X: ")
        assert sent_until_cut_off(client, b"x" * 65_536, times=800, pause=0.001) < 800


@pytest.mark.parametrize(
    "request_",
    [
        GET + b"Host: example.org\r\n\r\n",
        b"nonsense\r\n\r\n",
        GET + b"Content-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
        GET + b"Content-Length: 4\r\nContent-Length: 5\r\n\r\nxxxxx",
        GET + b"X : space before the colon\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nnonsense\r\n",
        b"GET / HTTP/1.1\r\n\r\n",
        b"GET http://evil.example/ HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET http://user@localhost/ HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"CONNECT localhost:80 HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET * HTTP/1.1\r\nHost: localhost\r\n\r\n",
        GET.replace(b"/ ", b"/\xff ") + b"\r\n",
        GET + b"Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
        GET + b"Transfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n",
        GET + b"Transfer-Encoding: xchunked\r\n\r\n0\r\n\r\n",
        GET.replace(b"1.1", b"1.0") + b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
        GET + b"Content-Length: 4\r\nContent-Length: 4\r\n\r\nxxxx",
        GET + b"Content-Length: +4\r\n\r\nxxxx",
        GET + b"X: 1\r\n folded\r\n\r\n",
    ],
)
def test_request_that_can_be_read_in_two_ways_is_refused(
    connect: Callable[[], socket.socket], request_: bytes
) -> None:
    assert status(asked(connect, request_)) == 400


@pytest.mark.parametrize(
    "parts",
    [GET, b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\nxxx"],
    ids=["a head", "a body"],
)
def test_slow_sender_is_told_and_cut_off(connect: Callable[[], socket.socket], parts: bytes) -> None:
    assert status(asked(connect, parts)) == 408


def test_dripping_sender_is_cut_off_all_the_same(connect: Callable[[], socket.socket]) -> None:
    with closing(connect()) as client:
        client.sendall(GET)
        assert sent_until_cut_off(client, b"X: 1\r\n", times=90, pause=0.05) < 90


def test_name_in_the_target_is_taken_where_it_is_the_host(connect: Callable[[], socket.socket]) -> None:
    head = GET.replace(b"GET /", b"GET http://localhost/") + b"Connection: close\r\n\r\n"
    assert asked(connect, head).endswith(FINE)


def test_body_that_pauses_is_cut_off_before_its_deadline() -> None:
    with serving(replace(SHORT, body_seconds=60, pause_seconds=0.2)) as connect:
        reply = asked(connect, GET.replace(b"GET", b"POST") + b"Content-Length: 9\r\n\r\nxxx")
        assert status(reply) == 408


@pytest.mark.slow
def test_large_reply_on_a_slow_line_comes_whole() -> None:
    with serving(replace(SHORT, unread_seconds=0.4, unread_bytes=1)) as connect, closing(connect()) as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65_536)
        client.sendall(b"GET /whole HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
        read = 0
        while part := client.recv(1_000_000):
            read += len(part)
            time.sleep(0.005)
        assert read > 20_000_000


def test_silent_connection_is_closed(connect: Callable[[], socket.socket]) -> None:
    assert asked(connect) == b""


@pytest.mark.slow
def test_stream_outlives_the_deadlines(connect: Callable[[], socket.socket]) -> None:
    reply = asked(connect, b"GET /stream HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
    assert reply.count(b"\r\nx\r\n") == 10


def test_client_that_does_not_read_is_cut_off(connect: Callable[[], socket.socket]) -> None:
    with closing(connect()) as client:
        client.sendall(b"GET /large HTTP/1.1\r\nHost: localhost\r\n\r\n")
        time.sleep(1.2)  # three times as long as it may
        assert len(told(client)) < 50_000_000


def test_rest_of_a_body_is_not_read_after_the_reply(connect: Callable[[], socket.socket]) -> None:
    with closing(connect()) as client:
        client.sendall(b"POST /early HTTP/1.1\r\nHost: localhost\r\nContent-Length: 999999\r\n\r\nxxx")
        reply = told(client)  # the end comes without the rest
    assert reply.endswith(FINE)
    assert b"\r\nconnection: close\r\n" in reply  # a proxy would send its next request here


def test_idle_connections_make_room_and_nobody_is_reset_in_silence() -> None:
    limits = replace(SHORT, connections=5, head_seconds=30)
    with serving(limits) as connect:
        idle = [connect() for _ in range(50)]
        assert asked(connect, GET + b"Connection: close\r\n\r\n").endswith(FINE)
        for client in idle:
            client.close()


def test_connection_too_many_is_told_while_all_work() -> None:
    with serving(replace(SHORT, connections=1)) as connect, closing(connect()) as first:
        first.sendall(b"GET /stream HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
        first.recv(1)
        reply = asked(connect, GET + b"\r\n")
        assert status(reply) == 503
        assert b"retry-after: 1" in reply
        assert told(first).count(b"\r\nx\r\n") == 10


@pytest.mark.slow
def test_garbage_behind_a_request_does_not_cut_its_reply(connect: Callable[[], socket.socket]) -> None:
    reply = asked(connect, b"GET /stream HTTP/1.1\r\nHost: localhost\r\n\r\n", b"nonsense\r\n\r\n")
    assert reply.count(b"\r\nx\r\n") == 10
    assert reply.count(b"HTTP/1.1") == 1
