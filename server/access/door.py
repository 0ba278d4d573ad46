"""The door: whose a request is, by its header or its cookie.

What was found is kept in this process, so that a request costs no query. Once a second one query asks for
the number that grows with each revocation; where it has grown, everything is read again.
"""

from __future__ import annotations

import asyncio
import hashlib
import time
from collections import OrderedDict
from collections.abc import Callable
from datetime import timedelta
from typing import TypeVar

import structlog
from anyio import CapacityLimiter, to_thread
from starlette.requests import HTTPConnection

from parenting.server.access import key, lookup
from parenting.server.access.guessing import Guesses
from parenting.server.access.lookup import Known
from parenting.server.access.roles import LOCAL, Principal, Way
from parenting.server.access.secret import digest, kind_of
from parenting.server.access.sessions import DAYS, IDLE_DAYS
from parenting.server.db import Database
from parenting.server.errors import BusyError, DamagedRowError, StoreError
from parenting.server.identity import database_id

FRESH_SECONDS = 1.0
"""Seconds after which a revocation by another process is known here."""
KEEP_SECONDS = 60.0
"""Seconds by which the stored time of the last use may be behind."""
WAITING = 64
"""Unknown secrets that are looked up or wait for it; more are refused: guessing costs others nothing."""
MOST_KNOWN = 20_000
MOST_WRONG = 4096
"""Wrong secrets that are refused without a look into the database when they come again."""
BEARER = "bearer "
WAYS: dict[str, Way] = {"session": "session", "program": "token"}

Found = TypeVar("Found")
log = structlog.get_logger()


class Door:
    """The callers of this web process, as far as it knows them."""

    def __init__(
        self, db: Database, secret_key: bytes, days: float = DAYS, idle_days: float = IDLE_DAYS
    ) -> None:
        """Prepare to recognise callers.

        Args:
            db: The database.
            secret_key: The key of the data folder (`access.key`).
            days: Days after which a session ends.
            idle_days: Days without use after which it ends.
        """
        self.db, self.days = db, days
        self.cookie = cookie_name(db)
        self._key, self.idle = secret_key, timedelta(days=idle_days)
        self._known: dict[str, Known] = {}
        self._revision, self._looked, self._kept = -1, float("-inf"), time.monotonic()
        self._reading, self._asking, self._waiting = asyncio.Lock(), asyncio.Semaphore(2), 0
        self._threads, self._fresh_threads = CapacityLimiter(2), CapacityLimiter(1)
        self.guesses = Guesses()
        self._former: set[str] = set()
        self._wrong: OrderedDict[str, None] = OrderedDict()
        self._keeping: asyncio.Task[None] | None = None

    async def principal(self, request: HTTPConnection) -> Principal | None:
        """Return whose a request is; None if nobody whom this server knows.

        Raises:
            StoreError: the database cannot be read now.
            TooManyGuessesError: the address has brought too many wrong secrets, and this one is not known.
        """
        given, client = (
            request.headers.get("authorization", ""),
            request.client.host if request.client else "",
        )
        if given[: len(BEARER)].lower() != BEARER:  # other schemes are those of a proxy that asks, too
            return await self._of(request.cookies.get(self.cookie, ""), "session", client)
        secret = given[len(BEARER) :].strip()
        server = request.scope.get("server")
        if key.holds(self._key, server[1] if server else None, secret):
            return LOCAL
        return await self._of(secret, "program", client)

    def forget(self) -> None:
        """Read sessions and tokens again: something was revoked by this process."""
        self._looked = float("-inf")

    async def _of(self, secret: str, kind: str, client: str) -> Principal | None:
        if kind_of(secret) != kind:
            if secret:
                self.guesses.require(client)
                self.guesses.wrong(client)
            return None
        await self._refresh()
        hashed, now = digest(secret), self.db.clock()
        known = self._known.get(hashed)
        if known is None or known.is_over(now):
            if kind == "session" and hashed in self._wrong:
                return None  # a browser whose session has ended; its pages go on asking
            known = await self._look(hashed, WAYS[kind], client)
            if known is None:
                return None
        known.seen = max(known.seen, now)
        return known.principal

    async def _refresh(self) -> None:
        if time.monotonic() - self._looked < FRESH_SECONDS:
            return
        async with self._reading:
            if time.monotonic() - self._looked < FRESH_SECONDS:
                return
            began = time.monotonic()
            present = await to_thread.run_sync(self._read, lookup.revision, limiter=self._fresh_threads)
            if present != self._revision or len(self._known) > MOST_KNOWN:
                self._forget_all()
            self._revision, self._looked = present, began
        if began - self._kept >= KEEP_SECONDS:
            self._kept = began
            self._keeping = asyncio.create_task(self._keep())

    def _forget_all(self) -> None:
        """Read everything again. Those who were known are asked for whatever else their address brings."""
        if len(self._former) > MOST_KNOWN:
            self._former.clear()
        self._former.update(self._known)
        self._known.clear()
        self._wrong.clear()

    async def _look(self, hashed: str, way: Way, client: str) -> Known | None:
        if self._waiting >= WAITING:
            raise BusyError("Too many unknown callers at once. Send the same again.")
        self._waiting += 1
        try:
            async with self._asking:
                if hashed not in self._former:
                    self.guesses.require(client)
                now, revision = self.db.clock(), self._revision
                found = await to_thread.run_sync(
                    self._read,
                    lambda session: lookup.find(session, way, hashed, now, self.idle),
                    limiter=self._threads,
                )
                if found is None:
                    self._note_wrong(hashed, client)
        finally:
            self._waiting -= 1
        self._known.pop(hashed, None)
        if found is not None and revision == self._revision:
            self._known[hashed] = found
        return found

    def _note_wrong(self, hashed: str, client: str) -> None:
        self.guesses.wrong(client)
        self._former.discard(hashed)
        self._wrong[hashed] = None
        if len(self._wrong) > MOST_WRONG:
            self._wrong.popitem(last=False)

    def _read(self, look: Callable[..., Found]) -> Found:
        with self.db.read() as session:
            return look(session)

    async def _keep(self) -> None:
        """Store when sessions were used last, apart from any request; the next time will do as well."""
        used = [
            one
            for one in self._known.values()
            if one.stored is None or (one.seen - one.stored).total_seconds() >= KEEP_SECONDS
        ]
        if used:
            await to_thread.run_sync(self._write, used, limiter=self._fresh_threads)

    def _write(self, used: list[Known]) -> None:
        try:
            with self.db.write(durable=False) as session:
                lookup.keep_uses(session, used)
        except StoreError as error:
            log.debug("last use not stored", reason=error.code)
            return
        for one in used:
            one.stored = one.seen


def cookie_name(db: Database) -> str:
    """Return the name of the cookie: browsers send cookies to every port, so that each house has its own."""
    try:
        named = database_id(db)
    except DamagedRowError:
        named = ""
    return f"parenting_session_{hashlib.sha256(named.encode()).hexdigest()[:8]}"
