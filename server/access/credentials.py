"""The credentials that commands send by themselves: a token, or the proof of the data folder's key."""

from __future__ import annotations

import ipaddress
from collections.abc import Generator
from pathlib import Path

import httpx2

from parenting.server.access.key import proof, read_key

PORTS = {"http": 80, "https": 443}


class Credentials(httpx2.Auth):
    """A token for every server, or else a proof for the servers of this machine (`access.key`)."""

    def __init__(self, token: str | None, folder: Path) -> None:
        """Take a token, or the key file of a data folder where there is no token."""
        self._token = token
        self._key = None if token else read_key(folder)

    def auth_flow(self, request: httpx2.Request) -> Generator[httpx2.Request, httpx2.Response, None]:
        """Put the header into a request."""
        if self._token:
            request.headers["Authorization"] = f"Bearer {self._token}"
        elif self._key and _is_here(request.url.host):
            port = request.url.port or PORTS.get(request.url.scheme, 80)
            request.headers["Authorization"] = f"Bearer {proof(self._key, port)}"
        yield request


def _is_here(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
