"""The numbers of `server.connections`, and the count of connections, in all and by client address."""

from __future__ import annotations

import ipaddress
from collections import Counter
from dataclasses import dataclass
from typing import Protocol

from parenting.server.public import Network

CODES = ("too_many", "too_large", "too_slow", "invalid")
"""The error codes of what is refused before the application sees it."""


@dataclass(frozen=True)
class Limits:
    """Bounds of one web process. Seconds are deadlines, not idle times, unless they say so."""

    connections: int = 1000
    """Connections at once. Where all are taken, the one that has been idle longest makes room."""
    per_client: int = 250
    """Connections of one address at once. Where it has them, its own longest idle one makes room. Loopback
    and the proxies, which stand for many, have no such bound."""
    proxies: tuple[Network, ...] = ()
    head_bytes: int = 16 * 1024
    """Bytes of a request's head: its first line and its headers."""
    headers: int = 100
    head_seconds: float = 10.0
    """From the connection, or the first byte of a later request, to the end of the head."""
    body_seconds: float = 30.0
    """From the end of the head to the end of the body. Streams send no body, so this does not end them."""
    pause_seconds: float = 10.0
    """Between two parts of a body."""
    unread_seconds: float = 30.0
    """Once the buffers between are full, a client must read `unread_bytes` of a reply in this time."""
    unread_bytes: int = 30 * 1024
    linger_seconds: float = 2.0
    """After a refusal: what still comes is dropped for this long, so that the client can read the reply."""


class Connection(Protocol):
    """A connection, as `Connections` sees it."""

    def idle(self) -> bool:
        """Return whether no request is on its way or being answered."""

    def end(self) -> None:
        """Close the connection."""


class Connections:
    """The open connections of one web process, oldest first."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self._open: dict[Connection, str] = {}  # insertion order: the oldest, or longest idle, first
        self._by_client: Counter[str] = Counter()
        self.ended = 0
        """Idle connections that made room."""
        self.refused: Counter[str] = Counter(dict.fromkeys(CODES, 0))
        """Requests and connections that were refused here, before the application, by error code."""

    def __len__(self) -> int:
        """Return the number of open connections."""
        return len(self._open)

    def admit(self, connection: Connection, client: str) -> bool:
        """Count a new connection; False if there is no room for it, not even by ending an idle one."""
        if not self._has_room(client):
            return False
        self._open[connection] = client
        self._by_client[client] += 1
        return True

    def touch(self, connection: Connection) -> None:
        """Note that a connection was used just now: it is the last to make room."""
        client = self._open.pop(connection, None)
        if client is not None:
            self._open[connection] = client

    def leave(self, connection: Connection) -> None:
        """Count a connection no longer; one that was not admitted changes nothing."""
        client = self._open.pop(connection, None)
        if client is None:
            return
        self._by_client[client] -= 1
        if not self._by_client[client]:
            del self._by_client[client]

    def _has_room(self, client: str) -> bool:
        """Return whether one more fits, once an idle one was ended for it where a bound is reached."""
        if not self._stands_for_many(client) and self._by_client[client] >= self.limits.per_client:
            return self._make_room(client)  # its place is the new one's, in all as well
        return len(self._open) < self.limits.connections or self._make_room()

    def _stands_for_many(self, client: str) -> bool:
        if is_loopback(client):
            return True
        proxies = self.limits.proxies
        return bool(proxies) and any(ipaddress.ip_address(client) in network for network in proxies)

    def _make_room(self, client: str | None = None) -> bool:
        """End the connection that has been idle longest, of this client if one is named."""
        open_ones = self._open.items()
        idle = (one for one, its in open_ones if client in (None, its) and one.idle())
        longest = next(idle, None)
        if longest is None:
            return False
        self.leave(longest)
        longest.end()
        self.ended += 1
        return True


def is_loopback(client: str) -> bool:
    """Return whether an address is of this machine; a name is not."""
    try:
        return ipaddress.ip_address(client).is_loopback
    except ValueError:
        return False
