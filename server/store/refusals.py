"""The one place that knows what a store can say: busy, refused, gone or damaged.

Sources: SQLite's result codes (https://www.sqlite.org/rescode.html) and PostgreSQL's SQLSTATEs
(https://www.postgresql.org/docs/current/errcodes-appendix.html). What is neither, such as a constraint that
does not hold or a mistake in our SQL, is not the store's refusal and passes through.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy.exc import DBAPIError
from sqlalchemy.exc import TimeoutError as NoConnectionError

from parenting.server.errors import (
    BusyError,
    DamagedError,
    DiskFullError,
    GoneError,
    RefusedError,
    StoreError,
)
from parenting.server.store.postgresql import PRIMARY

# The longest beginning of a name that fits decides.
SQLITE: dict[str, type[StoreError]] = {
    "SQLITE_BUSY": BusyError,
    "SQLITE_LOCKED": BusyError,
    "SQLITE_PROTOCOL": BusyError,
    "SQLITE_INTERRUPT": BusyError,
    "SQLITE_FULL": DiskFullError,
    "SQLITE_IOERR": RefusedError,  # a quota that is used up (EDQUOT) says this, too
    "SQLITE_READONLY": RefusedError,
    "SQLITE_PERM": RefusedError,
    "SQLITE_AUTH": RefusedError,
    "SQLITE_NOMEM": RefusedError,
    "SQLITE_NOLFS": RefusedError,
    "SQLITE_TOOBIG": RefusedError,
    "SQLITE_READONLY_DBMOVED": GoneError,
    "SQLITE_CANTOPEN": GoneError,
    "SQLITE_CORRUPT": DamagedError,
    "SQLITE_NOTADB": DamagedError,
    "SQLITE_FORMAT": DamagedError,
    "SQLITE_IOERR_CORRUPTFS": DamagedError,
    "SQLITE_IOERR_DATA": DamagedError,
}
POSTGRESQL: dict[str, type[StoreError]] = {
    "40001": BusyError,  # serialization
    "40P01": BusyError,  # deadlock
    "55P03": BusyError,  # lock_timeout
    "57014": BusyError,  # statement_timeout
    "25P03": BusyError,  # idle in a transaction for too long
    "53300": BusyError,  # too many connections
    "53100": DiskFullError,
    "53": RefusedError,  # other resources
    "25006": RefusedError,  # read-only: a standby
    "42501": RefusedError,  # no right to write
    "58": RefusedError,  # an error of the operating system, I/O included
    "08": GoneError,  # the connection
    "57P": GoneError,  # shut down, crashed, starting
    "28": GoneError,  # not let in
    "3D000": GoneError,  # no such database
    "XX001": DamagedError,
    "XX002": DamagedError,
}
CROWDED = re.compile("too many (clients|connections)|remaining connection slots")
"""Words of a server that lets nobody more in: libpq has no SQLSTATE before there is a connection."""
UNCONNECTED: dict[type[StoreError], str] = {
    GoneError: "The database cannot be reached: {cause}. Nothing was stored.",
    BusyError: "The database takes no more connections: {cause}. Nothing was stored.",
}
STATES = {
    "42501": "The database does not let its role do this: {cause}. Nothing was stored. Grant the role this "
    "right, or name another role in PARENTING_DATABASE_URL.",
    "25006": "The database takes no writes, as a standby or by a setting: {cause}. Nothing was stored. "
    f"{PRIMARY}",
}
"""The words of commands and logs for a refusal by PostgreSQL, with its reason; pages keep to the class's."""


@contextmanager
def translated() -> Iterator[None]:
    """Turn a refusal of the store into a `StoreError`; every other error passes.

    Raises:
        StoreError: the store was busy, refused, is gone or is damaged; nothing was stored.
    """
    try:
        yield
    except StoreError:
        raise
    except Exception as error:
        kind = refusal(error)
        if kind is None:
            raise
        raise kind(why=_why(error, kind)) from error


def refusal(error: BaseException) -> type[StoreError] | None:
    """Return the kind of refusal that an error is, or None if it is not the store's."""
    if isinstance(error, NoConnectionError):  # every connection of the pool was in use for five seconds
        return BusyError
    said = _said(error)
    name = getattr(said, "sqlite_errorname", None)
    if name is not None:
        return _longest(SQLITE, str(name))
    if not _is_psycopgs(said):
        return None
    state = getattr(said, "sqlstate", None)
    if state is None:  # the connection could not be made, or broke
        lost = type(said).__name__ in ("OperationalError", "ConnectionTimeout")
        return (BusyError if CROWDED.search(str(said)) else GoneError) if lost else None
    return _longest(POSTGRESQL, str(state))


def cause(error: BaseException) -> str:
    """Return PostgreSQL's own reason for an error, without a password; empty where it is not PostgreSQL's."""
    said = _said(error.__cause__ if isinstance(error, StoreError) and error.__cause__ else error)
    return _cause(str(said)) if _is_psycopgs(said) else ""


def _said(error: BaseException) -> BaseException | None:
    return error.orig if isinstance(error, DBAPIError) else error


def _is_psycopgs(said: BaseException | None) -> bool:
    return type(said).__module__.partition(".")[0] == "psycopg"


def _why(error: BaseException, kind: type[StoreError]) -> str | None:
    """Return what commands and logs say of a refusal by PostgreSQL, where its own reason helps."""
    said = _said(error)
    if not _is_psycopgs(said) or not (cause := _cause(str(said))):
        return None
    state = getattr(said, "sqlstate", None)
    sentence = STATES.get(str(state))
    if sentence is None and (state is None or kind is GoneError):
        sentence = UNCONNECTED.get(kind)
    return sentence and sentence.format(cause=cause)


def _cause(said: str) -> str:
    """Return the last line that libpq says of a failure, without what leads to it and without its hints.

    It names hosts, roles and databases, and never a password.
    """
    lines = re.split(r"\n(?=DETAIL|HINT|CONTEXT|LINE \d)", said.strip())[0].splitlines()
    own = [line for line in lines if line.strip() and not line.startswith(("\t", " "))]
    return re.split("connection (?:failed|is bad): |FATAL: +", own[-1])[-1].rstrip(". ") if own else ""


def _longest(kinds: dict[str, type[StoreError]], said: str) -> type[StoreError] | None:
    fitting = [begins for begins in kinds if said.startswith(begins)]
    return kinds[max(fitting, key=len)] if fitting else None
