"""The outermost middleware: each request has an id, is counted by its route, and names itself in the log."""

from __future__ import annotations

import asyncio
import secrets
import time

import structlog
from starlette.datastructures import MutableHeaders
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from parenting.server.errors import StoppingError
from parenting.server.log_lines import request
from parenting.server.meters import Meters
from parenting.server.route_names import route_of

log = structlog.get_logger()


class RequestMiddleware:
    """ASGI middleware around the whole application."""

    def __init__(self, app: ASGIApp, meters: Meters) -> None:
        self.app, self.meters = app, meters

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on; count it when its reply is complete."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        scope["request_id"] = secrets.token_hex(8)
        request.set(scope)
        status, began, replied = 500, time.perf_counter(), False

        async def counted(message: Message) -> None:
            nonlocal status, replied
            if message["type"] == "http.response.start":
                status, replied = message["status"], True
                MutableHeaders(scope=message)["X-Request-Id"] = scope["request_id"]
            await send(message)

        try:
            await self.app(scope, receive, counted)
        except asyncio.CancelledError:  # uvicorn cancels what goes on a second after the signal to stop
            if replied:
                raise
            stopping = StoppingError()
            await JSONResponse(stopping.body(), stopping.status)(scope, receive, counted)
        finally:
            seconds, route = time.perf_counter() - began, route_of(scope)
            self.meters.count(scope["method"], route, status, seconds)
            log.info(
                "request", method=scope["method"], route=route, status=status, ms=round(1e3 * seconds, 1)
            )
