"""Refusals, told as few entries: strangers decide how often they are refused.

A process counts refusals by reason and client, and writes what it has counted every half a minute and at its
end: at most `CLIENTS` entries with a client of their own, and one for each reason with the rest.
"""

from __future__ import annotations

import asyncio
import threading
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress

import structlog
from starlette.concurrency import run_in_threadpool

from parenting.server.audit.table import AuditEntry, Kind
from parenting.server.db import Database
from parenting.server.errors import StoreError

SECONDS = 30.0
"""Seconds between two writes."""
CLIENTS = 10
"""Entries of one write that name their client; the others are counted together."""
SEVERAL = "several clients"

log = structlog.get_logger()


class Refusals:
    """The refusals of one web process that are not written yet."""

    def __init__(self, db: Database) -> None:
        self._db = db
        self._lock = threading.Lock()
        self._counted: Counter[tuple[str, str, str]] = Counter()

    def note(self, reason: str, who: str, client: str) -> None:
        """Count one refusal.

        Args:
            reason: The code of the error: one of few.
            who: Who was refused, as the log names them.
            client: The address that asked.
        """
        with self._lock:
            key = (reason, who, client)
            if key not in self._counted and len(self._counted) >= CLIENTS:
                key = (reason, SEVERAL, "")
            self._counted[key] += 1

    def write(self) -> None:
        """Write what was counted, in one short transaction; what the store refuses is counted on."""
        with self._lock:
            counted, self._counted = self._counted, Counter()
        if not counted:
            return
        try:
            self._store(counted)
        except StoreError as error:
            log.warning("refusals not written", reason=error.code)
            with self._lock:
                self._counted += counted

    async def keep_writing(self) -> None:
        """Write every half a minute until cancelled."""
        while True:
            await asyncio.sleep(SECONDS)
            with suppress(Exception):  # the next time will do as well
                await run_in_threadpool(self.write)

    def _store(self, counted: Mapping[tuple[str, str, str], int]) -> None:
        now = self._db.clock()
        with self._db.write(durable=False) as session:
            session.add_all(
                AuditEntry(
                    created=now, kind=Kind.REFUSAL, what=reason, who=who, client=client or None, count=count
                )
                for (reason, who, client), count in counted.items()
            )
