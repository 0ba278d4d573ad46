"""All that a store can say when it refuses, raised at the n-th statement or commit by way of the tap."""

from __future__ import annotations

from typing import Any, NamedTuple

import psycopg
from psycopg import errors
from pysqlite3 import dbapi2 as sqlite

from tests.faults.tap import COMMIT, Moment


class Refusal(NamedTuple):
    """Errors of the driver, and the status with which the web has to pass each on."""

    name: str
    message: str
    status: int


SQLITE = [
    Refusal("SQLITE_BUSY", "database is locked", 503),
    Refusal("SQLITE_LOCKED", "database table is locked", 503),
    Refusal("SQLITE_FULL", "database or disk is full", 507),
    Refusal("SQLITE_IOERR_WRITE", "disk I/O error", 507),
    Refusal("SQLITE_READONLY", "attempt to write a readonly database", 507),
    Refusal("SQLITE_CANTOPEN", "unable to open database file", 503),
    Refusal("SQLITE_CORRUPT", "database disk image is malformed", 503),
    Refusal("SQLITE_NOTADB", "file is not a database", 503),
]
POSTGRESQL = [
    Refusal("40001", "could not serialize access", 503),
    Refusal("40P01", "deadlock detected", 503),
    Refusal("55P03", "canceling statement due to lock timeout", 503),
    Refusal("57014", "canceling statement due to statement timeout", 503),
    Refusal("53100", "could not extend file: No space left on device", 507),
    Refusal("25006", "cannot execute INSERT in a read-only transaction", 507),
    Refusal("57P01", "terminating connection due to administrator command", 503),
    Refusal("XX001", "invalid page in block 3", 503),
    Refusal("", "server closed the connection unexpectedly", 503),
]
REFUSALS = {"sqlite": SQLITE, "postgresql": POSTGRESQL}


def error_of(store: str, refusal: Refusal) -> Exception:
    """The driver's exception."""
    if store == "postgresql":
        kind: Any = errors.lookup(refusal.name) if refusal.name else psycopg.OperationalError
        refused: Exception = kind(refusal.message)
        return refused
    error: Any = sqlite.OperationalError(refusal.message)
    error.sqlite_errorname = refusal.name
    said: Exception = error
    return said


class Refuse:
    """Refuses once, at the n-th moment: before a statement or commit, or after a commit that succeeded."""

    def __init__(self, number: int, error: Exception, when: str) -> None:
        self.left, self.error, self.when = number, error, when
        self.act = ""

    @property
    def raised(self) -> bool:
        """Return whether there were so many moments."""
        return bool(self.act)

    def __call__(self, moment: Moment) -> None:
        if self.act or moment.when != self.when or (self.when == "after" and moment.act != COMMIT):
            return
        self.left -= 1
        if not self.left:
            self.act = " ".join(moment.act.split()[:3])
            raise self.error
