"""A middleware: it guards the entrance, refuses cross-site writes, sets safe headers, hides tracebacks.

A cross-site request is recognised by `Sec-Fetch-Site`, which every present browser sends, or by `Origin` in
older ones (as in Datasette and Go). A request with neither comes from a program and passes, because programs
on this machine may answer too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from parenting.server.audit.acting import a_request
from parenting.server.entrance import Entrance
from parenting.server.errors import Forbidden, ServerError, TooLargeError

SAFE_METHODS = ("GET", "HEAD", "OPTIONS")

NOBODY = "frame-ancestors 'none'"

log = structlog.get_logger()


EMPTY = "'sha256-47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU='"
"""The hash of nothing: Plotly adds a style element without text; its script sets the rules."""
POLICY = (
    f"default-src 'self'; style-src 'self' {EMPTY}; img-src 'self' data: blob:; object-src 'none'; "
    f"base-uri 'none'; form-action 'self'; {NOBODY}"
)
"""The Content-Security-Policy of every reply: scripts and styles come from our files only."""


HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class SecurityMiddleware:
    """ASGI middleware around the whole application."""

    def __init__(
        self,
        app: ASGIApp,
        largest_body: int,
        reply: Callable[[Request, ServerError], Response],
        larger: Mapping[str, int] | None = None,
    ) -> None:
        """Bound the bytes of a body, for a few paths (`larger`) by a number of their own.

        Args:
            app: The rest of the application. Its state has the `entrance`.
            largest_body: Bytes of a body at most.
            reply: Makes the reply of an error: JSON for programs, a page for people.
            larger: Path -> bytes of a body at most.
        """
        self.app, self.reply = app, reply
        self.largest_body, self.larger = largest_body, larger or {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, or refuse it with an error."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        started, size = False, 0
        most = self.larger.get(scope["path"], self.largest_body)

        async def bounded() -> Message:
            nonlocal size
            message = await receive()
            size += len(message.get("body", b""))
            if size > most:  # a body without a declared length, in chunks
                raise HTTPException(413, str(most))
            return message

        async def safely(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
                _let_frame(headers, scope)
            await send(message)

        try:
            refused = self.refusal(scope, most)
            with a_request((scope.get("client") or ("",))[0]):
                answer = self.app if refused is None else self.reply(Request(scope), refused)
                await answer(scope, bounded, safely)
        except ClientDisconnect:
            log.debug("client left", path=scope["path"])
        except Exception:
            log.exception("request failed", path=scope["path"], method=scope["method"])
            if started:
                raise  # part of the reply has been sent; uvicorn closes the connection
            await JSONResponse(ServerError().body(), 500)(scope, receive, safely)

    def refusal(self, scope: Scope, most: int) -> ServerError | None:
        """Return the error that refuses this request, or None."""
        entrance: Entrance = scope["app"].state.entrance
        refused = entrance.enter(scope)
        if refused is not None:
            return refused
        headers, method = Headers(scope=scope), scope["method"]
        length = headers.get("content-length", "0")
        if not length.isdecimal() or len(length) > 15 or int(length) > most:
            return TooLargeError(most=most)
        if method in SAFE_METHODS:
            return None
        site, origin = headers.get("sec-fetch-site"), headers.get("origin")
        if site is not None:
            return None if site in ("same-origin", "none") else Forbidden()
        if origin is not None:
            own = f"{scope['scheme']}://{headers['host']}"
            return None if origin == own else Forbidden()
        return None


def _let_frame(headers: MutableHeaders, scope: Scope) -> None:
    """Name the sites that may show the page in a frame: a notebook, where the settings say so."""
    settings = getattr(scope["app"].state, "settings", None)
    if settings is not None and settings.frame_ancestors != "none":
        name = "Content-Security-Policy"
        headers[name] = headers[name].replace(NOBODY, f"frame-ancestors {settings.frame_ancestors}")
