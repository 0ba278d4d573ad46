"""A client of the HTTP API. It tells a server that is away from one that refuses a request."""

from __future__ import annotations

import re
from typing import Any

import httpx2

from parenting.commands.errors import UsageError, settings
from parenting.server.access.credentials import Credentials

SECONDS = 10.0
"""Seconds that a single request may take."""
SENDABLE = re.compile("[!-~]+")
"""Tokens whose characters a header may hold."""


class UnavailableError(Exception):
    """The server does not answer now, or not properly; it may in a moment."""


class RefusedError(UsageError):
    """The server refuses a request, and says why."""

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = status


class Client:
    """The API of one server, over one open connection."""

    def __init__(self, url: str, http: httpx2.Client | None = None) -> None:
        """Prepare a connection, which opens at the first request.

        Args:
            url: The server's address.
            http: Another connection, for example to an application in this process.

        Raises:
            UsageError: the address cannot be read.
        """
        self.url = url.rstrip("/")
        try:
            address = httpx2.URL(self.url)
        except httpx2.InvalidURL as error:
            raise UsageError(f"--url: {url} cannot be read: {error}. {_EXAMPLE}") from None
        if address.scheme not in ("http", "https") or not address.host:
            raise UsageError(f"--url: {url} is not the address of a server. {_EXAMPLE}")
        # The server accepts only the names of this machine, so no proxy lies on the way.
        self.http = http or httpx2.Client(timeout=SECONDS, trust_env=False, auth=credentials())

    def close(self) -> None:
        """Close the connection."""
        self.http.close()

    def get(self, path: str) -> Any:
        """Return the reply to a GET of a path of the API.

        Raises:
            UnavailableError: the server does not answer now.
            RefusedError: the server refuses the request.
            UsageError: the address is not that of a Parenting server.
        """
        return self.read(self._send("GET", path, None))

    def post(self, path: str, **body: Any) -> Any:
        """Return the reply to a POST to a path of the API; None if it is empty.

        Raises:
            UnavailableError, RefusedError, UsageError: as `get`.
        """
        return self.read(self._send("POST", path, body or None))

    def _send(self, method: str, path: str, body: Any) -> httpx2.Response:
        try:
            return self.http.request(method, f"{self.url}/api/v1/{path}", json=body)
        except httpx2.TransportError as error:
            raise self.away(error) from error

    def away(self, error: Exception) -> UnavailableError:
        """Return the error for a request that nobody answered."""
        return UnavailableError(f"No server answers at {self.url} ({_reason(error)}).")

    def read(self, reply: httpx2.Response) -> Any:
        """Return what a reply of the API says; None if it is empty.

        Raises:
            UnavailableError, RefusedError, UsageError: as `get`.
        """
        if reply.status_code == 204:
            return None
        try:
            said = reply.json()
        except ValueError:
            said = None
        if reply.is_success and isinstance(said, dict):
            return said
        error = said.get("error") if isinstance(said, dict) else None
        message = error.get("message") if isinstance(error, dict) else None
        if reply.status_code >= 500:
            raise UnavailableError(message or f"{self.url} answers {reply.status_code}.")
        if message is None:
            raise self._stranger(reply)
        raise RefusedError(reply.status_code, message)

    def _stranger(self, reply: httpx2.Response) -> UsageError:
        return UsageError(
            f"--url: {self.url} is not a server of Parenting: it answers {reply.status_code} at "
            f"{reply.request.url.path}. {_EXAMPLE}"
        )


def credentials() -> Credentials:
    """Return what this user's commands send: PARENTING_TOKEN, or the proof of the data folder's key.

    Raises:
        ServerError: a setting is wrong.
        UsageError: the token holds what no header can.
    """
    chosen = settings()
    token = None if chosen.token is None else chosen.token.get_secret_value()
    if token and not SENDABLE.fullmatch(token):
        raise UsageError(
            "PARENTING_TOKEN: it holds a blank, a line end or another character that no token has. "
            "Set it to a token alone, as `parenting access create token` prints it."
        )
    return Credentials(token, chosen.data)


_EXAMPLE = "Write it as http://localhost:8765; `parenting up` says which it is."


def _reason(error: Exception) -> str:
    return str(error) or type(error).__name__
