"""Guessing is slowed: each address may bring a few wrong secrets, and then one in a while.

A secret has 256 random bits, so no guess finds one; the bound is there for the others, who share the store
with whoever guesses. Where secrets that are known to be right come from the same address, nothing is counted.
"""

from __future__ import annotations

import ipaddress
import math
import time
from collections import OrderedDict
from collections.abc import Callable
from threading import Lock

from parenting.server.errors import TooManyGuessesError

AT_ONCE = 30
"""Wrong secrets that an address may bring at once."""
PER_SECOND = 1.0
"""Wrong secrets that it may bring besides, each second."""
ADDRESSES = 4096
"""Addresses that are remembered. Whoever has more of them is slowed by `door.WAITING` alone."""


class Guesses:
    """The guesses that are left to each address. Several threads may use it."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        """`now` returns seconds."""
        self._now, self._lock = now, Lock()
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def require(self, client: str) -> None:
        """Ask whether an address may bring a secret that nobody knows yet.

        Raises:
            TooManyGuessesError: it has brought too many wrong ones.
        """
        with self._lock:
            left = self._of(_place(client))
        if left < 1:
            raise TooManyGuessesError(seconds=math.ceil((1 - left) / PER_SECOND))

    def wrong(self, client: str) -> None:
        """Count a wrong secret."""
        place = _place(client)
        with self._lock:
            self._left[place] = max(0.0, self._of(place) - 1), self._now()
            self._left.move_to_end(place)
            if len(self._left) > ADDRESSES:
                self._left.popitem(last=False)

    def _of(self, place: str) -> float:
        left, since = self._left.get(place, (float(AT_ONCE), 0.0))
        return min(float(AT_ONCE), left + (self._now() - since) * PER_SECOND)


def _place(client: str) -> str:
    """Return what counts as one address: of IPv6 the network, of which a household has all addresses."""
    try:
        address = ipaddress.ip_address(client)
    except ValueError:
        return client
    if isinstance(address, ipaddress.IPv4Address):
        return str(address)
    return str(ipaddress.ip_network((int(address), 64), strict=False))
