"""The right to stay: who has a stream open, or waits for a question, is asked for again while it lasts."""

from __future__ import annotations

import time

from fastapi import Request

from parenting.server.access.door import Door
from parenting.server.access.guard import principal_of
from parenting.server.errors import StoreError, TooManyGuessesError

SECONDS = 3.0
"""Seconds after which the door is asked again. It knows whom it knows, so that this costs no query."""


class Stay:
    """One request that lasts, and whether whoever sent it may still have what it brings."""

    def __init__(self, request: Request) -> None:
        """Begin with the principal that the guard has let in."""
        self.seconds = SECONDS
        self._request, self._who = request, principal_of(request)
        self._door: Door = request.app.state.door
        self._asked, self._over = time.monotonic(), False

    async def is_over(self) -> bool:
        """Return whether the session, link or token has been revoked or has expired since.

        While the database cannot be read, nobody is sent away.
        """
        if not self._over and time.monotonic() - self._asked >= self.seconds:
            self._asked = time.monotonic()
            self._over = not await self._is_known()
        return self._over

    async def is_left(self) -> bool:
        """Return whether the client has gone, or may not stay."""
        return await self._request.is_disconnected() or await self.is_over()

    async def _is_known(self) -> bool:
        if self._who.way == "key":  # its proof is for the moment of opening, and the key is not revoked
            return True
        try:
            return await self._door.principal(self._request) == self._who
        except TooManyGuessesError:  # somebody who is known is never asked to wait
            return False
        except StoreError:
            return True
