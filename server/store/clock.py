"""The clock of leases and claims: one that all processes of a database share and that nobody sets back.

On SQLite that is the time since the machine was started, sleep included (CLOCK_BOOTTIME), with the machine's
boot id; on PostgreSQL it is the server's own clock, which a transaction is told as it begins. The times that
people see are those of the wall clock, and nothing is decided by them. So a wall clock that is an hour off,
or jumps, changes nothing.

A lease or a claim holds from the mark at which it began to the mark at which it ends. One of another boot, or
one that seems to begin in the future because PostgreSQL's clock was set back, is over.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from sqlalchemy import ColumnElement, and_, bindparam, or_, text
from sqlalchemy.orm import Session

SLACK = 1.0
"""Seconds by which a mark may lie ahead: PostgreSQL's clock is corrected by fractions of a second, and a
process may be a tenth of one behind it (`postgresql_connections.PROMPT_SECONDS`)."""
LONGEST = 12
"""Characters of a boot id that are kept: each question has one. The last group of a UUID has so many."""
BOOT_ID = Path("/proc/sys/kernel/random/boot_id")
SYSCTL = ("sysctl", "-n", "kern.bootsessionuuid")
_SERVER_TIME = text("SELECT CAST(extract(epoch FROM clock_timestamp()) AS double precision)")


SERVER_TIME = "server time"
"""The key of a connection's `info` under which its transaction keeps what it was told."""


class ServerTime(NamedTuple):
    """PostgreSQL's clock, and `since_boot` when it was heard."""

    seconds: float
    heard: float


class Mark(NamedTuple):
    """A moment: seconds of a clock that is named by its epoch. Marks of two epochs cannot be compared."""

    epoch: str
    seconds: float

    def is_recent(self, epoch: Any, seconds: Any, most: float) -> bool:
        """Return whether a stored mark is at most so many seconds old."""
        if not isinstance(epoch, str) or not isinstance(seconds, float):
            return False
        return epoch == self.epoch and self.seconds - most < seconds <= self.seconds + SLACK

    def bound(self) -> dict[str, Any]:
        """Return the parameters of `holds` and `is_over`."""
        return {"epoch": self.epoch, "now": self.seconds, "ahead": self.seconds + SLACK}


Marks = Callable[[Session], Mark]
"""A function that returns the present mark, inside a transaction of the database."""


def boot_mark(_session: Session | None = None) -> Mark:
    """Return the time since this machine was started, sleep included."""
    boot = _boot_id()
    if boot is None:
        return Mark("wall clock", time.time())
    return Mark(boot[-LONGEST:], since_boot())


def since_boot() -> float:
    """Return the seconds since this machine was started, sleep included where it counts it."""
    return time.clock_gettime(getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC))


def server_mark(session: Session) -> Mark:
    """Return the time of PostgreSQL's own clock: as the transaction began, and what has passed here since.

    The server is asked where its word came late, or no transaction has begun.
    """
    told: ServerTime | None = session.connection().info.get(SERVER_TIME)
    if told is None:
        return Mark("postgresql", session.execute(_SERVER_TIME).scalar_one())
    return Mark("postgresql", told.seconds + since_boot() - told.heard)


def holds(epoch: Any, begin: Any, end: Any) -> ColumnElement[bool]:
    """Return the condition that a lease or claim with these columns holds at the mark that is bound."""
    return and_(epoch == bindparam("epoch"), begin <= bindparam("ahead"), end > bindparam("now"))


def is_over(epoch: Any, begin: Any, end: Any) -> ColumnElement[bool]:
    """Return the contrary of `holds`, which is true of one that was never given, too."""
    never = or_(epoch.is_(None), begin.is_(None), end.is_(None))
    other = epoch != bindparam("epoch")
    return or_(never, other, begin > bindparam("ahead"), end <= bindparam("now"))


@cache
def _boot_id() -> str | None:
    """Return what names this start of the machine: Linux's boot id, or that of macOS; None elsewhere."""
    try:
        return BOOT_ID.read_text(encoding="ascii").strip()
    except OSError:
        pass
    try:
        found = subprocess.run(SYSCTL, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None
    return found or None
