"""The one place that knows what a store can say: busy, refused, gone or damaged.

Sources: SQLite's result codes (https://www.sqlite.org/rescode.html) and PostgreSQL's SQLSTATEs
(https://www.postgresql.org/docs/current/errcodes-appendix.html). What is neither, such as a constraint that
does not hold or a mistake in our SQL, is not the store's refusal and passes through.
"""

from __future__ import annotations

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
        raise kind() from error


def refusal(error: BaseException) -> type[StoreError] | None:
    """Return the kind of refusal that an error is, or None if it is not the store's."""
    if isinstance(error, NoConnectionError):  # every connection of the pool was in use for five seconds
        return BusyError
    said = error.orig if isinstance(error, DBAPIError) else error
    name = getattr(said, "sqlite_errorname", None)
    if name is not None:
        return _longest(SQLITE, str(name))
    if type(said).__module__.partition(".")[0] != "psycopg":
        return None
    state = getattr(said, "sqlstate", None)
    if state is None:  # no word from the server: the connection could not be made, or broke
        return GoneError if type(said).__name__ in ("OperationalError", "ConnectionTimeout") else None
    return _longest(POSTGRESQL, str(state))


def _longest(kinds: dict[str, type[StoreError]], said: str) -> type[StoreError] | None:
    fitting = [begins for begins in kinds if said.startswith(begins)]
    return kinds[max(fitting, key=len)] if fitting else None
