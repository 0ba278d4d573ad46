"""The live streams that a browser and a client have open, and their limits."""

from __future__ import annotations

import ipaddress
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

from starlette.requests import Request

from parenting.server.errors import TooManyOfOneError

COOKIE = "parenting_client"
"""The cookie by which a browser is known."""


class Seat(NamedTuple):
    """The browser that has a stream open, if it has our cookie, and the client by its address."""

    browser: str
    client: str


class Seats:
    """The open streams of a web process, by browser and by client.

    Loopback, where a proxy or a tunnel stands for many, has no limit as a client.
    """

    def __init__(self, per_browser: int, per_client: int) -> None:
        self.per_browser, self.per_client = per_browser, per_client
        self._browsers: Counter[str] = Counter()
        self._clients: Counter[str] = Counter()

    def check(self, request: Request) -> None:
        """Refuse one stream too many.

        Raises:
            TooManyOfOneError: the browser or the client has as many as it may.
        """
        seat = _seat(request)
        crowded = self._browsers[seat.browser] >= self.per_browser if seat.browser else False
        if crowded or (self._clients[seat.client] >= self.per_client and not _is_here(seat.client)):
            raise TooManyOfOneError

    @contextmanager
    def taken(self, request: Request) -> Iterator[None]:
        """Count a stream within the block."""
        seat = _seat(request)
        pairs = ((self._browsers, seat.browser), (self._clients, seat.client))
        for counter, name in pairs:
            counter[name] += 1
        try:
            yield
        finally:
            for counter, name in pairs:
                counter[name] -= 1
                if counter[name] <= 0:
                    del counter[name]


def _seat(request: Request) -> Seat:
    return Seat(request.cookies.get(COOKIE, ""), request.client.host if request.client else "")


def _is_here(client: str) -> bool:
    try:
        return ipaddress.ip_address(client).is_loopback
    except ValueError:
        return False
