"""The last known state of a run, shared by all who wait for news of it."""

from __future__ import annotations

import asyncio
import time
from contextlib import suppress
from dataclasses import dataclass, field

from parenting.server.reads.offering import Offer
from parenting.server.reads.watching import Rows, Seen

UNSURE_SECONDS = 1.0
"""Seconds after which a run whose worker is silent is read again: others decide whether one may come."""
NOTHING = "null"
"""The most urgent question, as it is seen where none is open."""


@dataclass
class Subscription:
    """The last known state of one run, shared by all who wait for news of it."""

    streams: int = 0
    requests: int = 0  # that wait for a question
    holders: int = 0  # both of them, and who else has it watched
    seen: Seen | None = None  # by its streams
    offers: Offer | None = None  # by those who wait for a question, where it has no streams
    run: str = ""  # as JSON
    stale: bool = True  # it has changed since
    untold: bool = False  # its streams have not been told of the last change
    told: float = float("-inf")  # when they were, by the monotonic clock
    read: float = float("-inf")  # when it was read, by the monotonic clock
    rows: dict[int, asyncio.Future[Rows]] = field(default_factory=dict)  # its metrics after a tick
    changed: asyncio.Event = field(default_factory=asyncio.Event)
    offered: asyncio.Event = field(default_factory=asyncio.Event)
    gone: bool = False  # the run was deleted

    def offer(self) -> None:
        """Wake those who wait for a question."""
        self.offered.set()
        self.offered = asyncio.Event()

    def tell(self) -> None:
        """Wake the streams."""
        self.untold, self.told = False, time.monotonic()
        self.changed.set()
        self.changed = asyncio.Event()

    def take(self, seen: Seen | None, now: float) -> None:
        """Note what was seen of the run, and wake those whom it concerns."""
        before, self.seen, self.offers = self.seen, seen, None
        if seen is None:
            self.leave()
            return
        if before is None or (seen.offers != before.offers and seen.question != NOTHING):
            self.offer()  # after an answer there is nothing to lease until the agent asks again
        if before is None or (seen.question, seen.leases) != (before.question, before.leases):
            self.untold = True
        changed = before is None or (seen.row, seen.signed) != (before.row, before.signed)
        if changed or (not seen.signed and now - self.read >= UNSURE_SECONDS):
            self.stale = True

    def take_offer(self, offers: Offer | None) -> None:
        """Note what a run without streams offers, and wake those who wait where they may find a question."""
        before, self.offers, self.seen = self.offers, offers, None
        if offers is None:
            self.leave()
        elif offers != before and offers.free:
            self.offer()

    def leave(self) -> None:
        """End what lasts, as the run is not here any more; whoever comes again gets 404."""
        self.gone = True
        self.offer()
        self.tell()


async def either(event: asyncio.Event, timeout: float) -> None:
    """Wait for an event, or for so many seconds."""
    with suppress(TimeoutError):
        await asyncio.wait_for(event.wait(), max(timeout, 0.0))
