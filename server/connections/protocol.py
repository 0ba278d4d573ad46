"""uvicorn's HTTP protocol with bounds: the bytes, headers and seconds of a request, and the connections.

httptools parses as in uvicorn. It would take a head of any size, and its time grows with the square of an
incomplete header; so at most `head_bytes` of a head ever reach it. A refused request gets a short reply and
the connection ends. What the client still sends is dropped for a moment, since closing at once would reset
the connection before the reply is read.
"""

from __future__ import annotations

import asyncio
import json
from collections import deque
from functools import partial
from http import HTTPStatus
from typing import Any

import httptools
from starlette.types import Message, Send
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

from parenting.server.connections.head import UnclearHeadError, check_head
from parenting.server.connections.limits import Connections, Limits

SLICE = 64 * 1024
"""Bytes that the parser gets at once; within a head fewer."""


class RefusedRequestError(Exception):
    """The request breaks a bound; raised in the parser's callbacks, which stops the parser."""

    def __init__(self, status: int, code: str, message: str) -> None:
        self.status, self.code, self.message = status, code, message
        super().__init__(message)


class BoundedProtocol(HttpToolsProtocol):
    """One connection. `bounded` makes the class of a server."""

    open_connections: Connections

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.limits: Limits = self.open_connections.limits
        self._in_head, self._in_body, self._head_bytes = True, False, 0
        self._refused: RefusedRequestError | None = None
        self._ending = False
        self._deadline: asyncio.TimerHandle | None = None
        self._body_end = 0.0
        self._cycles: deque[RequestResponseCycle] = deque()  # requests without a whole reply, in their order
        self._unread: asyncio.TimerHandle | None = None
        self._announced: RequestResponseCycle | None = None  # its reply says that the connection ends

    # What the transport calls

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a connection up, or refuse it at once where there is no room."""
        super().connection_made(transport)
        client = self.client[0] if self.client else ""
        if self.open_connections.admit(self, client):
            self._set_deadline(self.limits.head_seconds)
        else:
            self._refuse(RefusedRequestError(503, "too_many", "Too many connections are open. Try again."))

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self.open_connections.leave(self)
        self._cancel(self._deadline)
        self._cancel(self._unread)
        for cycle in self._cycles:  # uvicorn tells the last one only
            cycle.disconnected = True
            cycle.message_event.set()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Give the parser what arrives, as much of a head as is allowed, and refuse the rest."""
        self._unset_keepalive_if_required()
        view = memoryview(data)
        while view and not self._ending:
            if self._in_head and self._deadline is None:  # a later request of this connection begins
                self._set_deadline(self.limits.head_seconds)
            room = self.limits.head_bytes - self._head_bytes if self._in_head else SLICE
            part, view = view[:room], view[room:]
            if self._in_head:
                self._head_bytes += len(part)
            self._feed(bytes(part))
            if self._in_head and self._head_bytes >= self.limits.head_bytes:
                most = self.limits.head_bytes
                self._refuse(RefusedRequestError(431, "too_large", f"A head may have {most} bytes."))

    def pause_writing(self) -> None:
        """Wait for a client that does not read its reply, for a bounded time."""
        super().pause_writing()
        self._expect_reading()

    def resume_writing(self) -> None:
        """Go on: the client reads again."""
        super().resume_writing()
        self._cancel(self._unread)

    def _expect_reading(self) -> None:
        left = self.transport.get_write_buffer_size()
        self._unread = self.loop.call_later(self.limits.unread_seconds, self._check_reading, left)

    def _check_reading(self, left: int) -> None:
        if self.transport.get_write_buffer_size() > left - self.limits.unread_bytes:
            self.transport.abort()
        else:  # a large reply on a slow line
            self._expect_reading()

    # What the parser calls

    def on_message_begin(self) -> None:
        """Begin a head."""
        super().on_message_begin()
        self._in_head = True
        self.open_connections.touch(self)

    def on_header(self, name: bytes, value: bytes) -> None:
        """Take a header, if there are not too many."""
        super().on_header(name, value)
        if len(self.headers) > self.limits.headers:
            most = self.limits.headers
            self._stop(RefusedRequestError(431, "too_large", f"A request may have {most} headers."))

    def on_headers_complete(self) -> None:
        """Check the head and start the application."""
        try:
            check_head(self.parser.get_method(), self.url, self.parser.get_http_version(), self.headers)
        except UnclearHeadError as error:
            self._stop(RefusedRequestError(400, "invalid", str(error)))
        self._in_head, self._in_body, self._head_bytes = False, True, 0
        self._set_deadline(self.limits.pause_seconds)
        super().on_headers_complete()
        self._cycles.append(self.cycle)
        cycle: Any = self.cycle
        cycle.send = partial(self._send, cycle, cycle.send)  # its task is to begin
        self._body_end = self.loop.time() + self.limits.body_seconds

    def on_body(self, body: bytes) -> None:
        """Take a part of a body: the next one must come soon, and the last one within the deadline."""
        super().on_body(body)
        self._set_deadline(min(self.limits.pause_seconds, self._body_end - self.loop.time()))

    def on_message_complete(self) -> None:
        """End the body."""
        super().on_message_complete()
        self._in_head, self._in_body = True, False
        self._cancel(self._deadline)
        self._deadline = None

    def on_response_complete(self) -> None:
        """Go on with the next request, unless the reply came before the body: then the rest is not read."""
        cycle = self._cycles.popleft()
        self.open_connections.touch(self)
        ends = cycle is self._announced or (self._in_body and not self.pipeline)
        if ends and not self.transport.is_closing():
            self._linger()
            return
        super().on_response_complete()

    async def _send(self, cycle: RequestResponseCycle, send: Send, message: Message) -> None:
        """Announce the end of the connection with a reply that comes before the whole body.

        A proxy keeps the connection otherwise, and its next POST, which it may not repeat, fails.
        """
        if message["type"] == "http.response.start" and cycle is self.cycle and self._in_body:
            cycle.keep_alive, self._announced = False, cycle  # uvicorn writes the header
            await send(message)
            cycle.keep_alive = True  # it would close at once; `on_response_complete` lingers
        else:
            await send(message)

    # What `Connections` calls

    def idle(self) -> bool:
        """Return whether no request is being answered and no body is on its way."""
        cycle: RequestResponseCycle | None = self.cycle  # none before the first request
        return not self._in_body and (cycle is None or cycle.response_complete)

    def end(self) -> None:
        """Close the connection, to make room for another."""
        self._ending = True
        self.transport.abort()

    def _feed(self, data: bytes) -> None:
        try:
            self.parser.feed_data(data)
        except httptools.HttpParserUpgrade:
            pass  # nothing here speaks another protocol; the request was answered as it is
        except httptools.HttpParserError:
            if not self._ending:
                message = "This is not an HTTP request that can be read."
                self._refuse(self._refused or RefusedRequestError(400, "invalid", message))

    def _stop(self, refused: RefusedRequestError) -> None:
        self._refused = refused
        raise refused

    def _late(self) -> None:
        part = "head" if self._in_head else "body"
        if self._in_head and not self._head_bytes:  # nothing was ever sent: nobody waits for a reply
            self._ending = True
            self.transport.abort()
        else:
            self._refuse(RefusedRequestError(408, "too_slow", f"The {part} of this request came too slowly."))

    def _refuse(self, refused: RefusedRequestError) -> None:
        """Reply by ourselves, unless a reply is on its way, and end the connection."""
        if self._ending:
            return
        self.open_connections.refused[refused.code] += 1
        cycle: RequestResponseCycle | None = self.cycle  # none before the first request
        if cycle is not None and not cycle.response_complete:
            if not self._in_body:  # a request before this one is still being answered
                self._ending, cycle.keep_alive = True, False
                return
            cycle.disconnected = True  # the application waits for a body that will not be whole
            cycle.message_event.set()
        if cycle is None or cycle.response_complete or not cycle.response_started:
            self.transport.write(_reply(refused))
        self._linger()

    def _linger(self) -> None:
        """Close our side, drop what still comes for a moment, then close the other side."""
        self._ending = True
        self.flow.resume_reading()
        if self.transport.can_write_eof():
            self.transport.write_eof()
        self._set_deadline(self.limits.linger_seconds, self.transport.abort)

    def _set_deadline(self, seconds: float, late: Any = None) -> None:
        self._cancel(self._deadline)
        self._deadline = self.loop.call_later(seconds, late or self._late)

    def _cancel(self, timer: asyncio.TimerHandle | None) -> None:
        if timer is not None:
            timer.cancel()


def bounded(limits: Limits) -> type[BoundedProtocol]:
    """Return the protocol class of one server, for uvicorn's `http` parameter; it counts its connections."""
    return type("CountedProtocol", (BoundedProtocol,), {"open_connections": Connections(limits)})


def _reply(refused: RefusedRequestError) -> bytes:
    body = json.dumps({"error": {"code": refused.code, "message": refused.message}}).encode()
    head = (
        f"HTTP/1.1 {refused.status} {HTTPStatus(refused.status).phrase}\r\n"
        "content-type: application/json\r\nx-content-type-options: nosniff\r\n"
        f"content-length: {len(body)}\r\nconnection: close\r\n"
        + ("retry-after: 1\r\n" if refused.status == 503 else "")
        + "\r\n"
    )
    return head.encode() + body
