"""One person of a crowd, with a name and a connection.

A crowd sends a hundred requests a second from one process. The models of requests and redirects of httpx
would take half of its processor time, so its connections send by httpcore, on which httpx stands. The headers
are those that httpx would send, and httpx reads the replies.
"""

from __future__ import annotations

import json
from ssl import SSLContext
from types import TracebackType
from typing import Any

import httpcore2
import httpx2

from parenting.commands.client import SECONDS, Client

WAIT = 5.0
"""Seconds for which a request for a question lies at the server."""
PATIENCE = {"timeout": {"connect": SECONDS, "read": WAIT + SECONDS, "write": SECONDS, "pool": SECONDS}}
IDLE = 5.0
"""Seconds for which a connection stays open unused."""
AWAY = (httpcore2.TimeoutException, httpcore2.NetworkError, httpcore2.ProtocolError, httpx2.DecodingError)
JSON = (b"Content-Type", b"application/json")
COOKIE = "parenting_client"


class Person:
    """One person's connection to the server, which opens at the first request."""

    def __init__(self, client: Client, name: str, tls: SSLContext | None) -> None:
        """Prepare a connection to the server of `client`, with its credentials.

        Args:
            client: A client of the same server.
            name: The person's name, as a browser's cookie has it.
            tls: What is trusted, for an address with https; the people of a crowd share it.
        """
        self.client, self.name = client, name
        url = f"{client.url}/api/v1/"
        self._request = client.http.build_request("GET", url, cookies={COOKIE: name})
        self._pool = httpcore2.AsyncConnectionPool(tls, max_connections=1, keepalive_expiry=IDLE)

    async def __aenter__(self) -> Person:
        """Return this person."""
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the connection."""
        await self._pool.aclose()

    def said(self, **body: Any) -> dict[str, Any]:
        """Return a body in this person's name."""
        return {"client_id": self.name, **body}

    async def get(self, path: str) -> Any:
        """Return the reply to a GET; raises as `Client.get`."""
        return await self._send("GET", path, None)

    async def post(self, path: str, body: dict[str, Any] | None = None) -> Any:
        """Return the reply to a POST; raises as `Client.post`."""
        return await self._send("POST", path, body)

    async def _send(self, method: str, path: str, body: dict[str, Any] | None) -> Any:
        content = None if body is None else json.dumps(body, separators=(",", ":")).encode()
        if method == "POST":
            content = content or b""  # httpcore tells its length
        headers = [*self._known(), *([JSON] if content else [])]
        try:
            reply = await self._pool.request(
                method, self._address(path), headers=headers, content=content, extensions=PATIENCE
            )
            read = httpx2.Response(reply.status, headers=reply.headers, content=reply.content)
        except AWAY as error:
            raise self.client.away(error) from None
        if not read.is_success:
            read.request = httpx2.Request(
                method, f"{self.client.url}/api/v1/{path}"
            )  # for what is told of it
        return self.client.read(read)

    def _known(self) -> list[tuple[bytes, bytes]]:
        """Return the headers of every request; a proof is good for minutes only, so each has its own."""
        if self.client.http.auth is not None:
            next(self.client.http.auth.auth_flow(self._request))
        return self._request.headers.raw

    def _address(self, path: str) -> httpcore2.URL:
        """Return where a path of the API is, without another look at what was looked at before."""
        url = self._request.url
        target = url.raw_path + path.encode()
        return httpcore2.URL(scheme=url.raw_scheme, host=url.raw_host, port=url.port, target=target)


def trust(client: Client) -> SSLContext | None:
    """Return what a connection to an address with https trusts; None for one without."""
    secure = httpx2.URL(client.url).scheme == "https"
    return httpx2.create_ssl_context(trust_env=False) if secure else None
