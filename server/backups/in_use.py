"""Detection of programs that use a database: nothing is put in place of what they have open.

Pages and workers hold a socket in the data folder as long as they live, stopped ones included. SQLite leaves
its log only when no other connection is left. PostgreSQL lists its connections.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, create_engine, text
from sqlalchemy.exc import DBAPIError

from parenting._plural import counted
from parenting.server.errors import SetupError
from parenting.server.notify import Notifier
from parenting.server.store import postgresql
from parenting.server.store.refusals import cause
from parenting.server.store.sqlite import sqlite_module

CHANNELS = {"web": "pages are served", "worker": "a worker is running"}
PATIENCE = 0.5
"""Seconds to wait for a command that just ends."""
STOP = "Stop `parenting up`, `web` and `worker` first."


def require_stopped(data: Path) -> None:
    """Refuse while pages or a worker of this data folder live.

    Raises:
        SetupError: one lives; the sentence names the remedy.
    """
    for channel, said in CHANNELS.items():
        if Notifier(data, channel).listeners():
            raise SetupError(f"The database is in use: {said} on {data}. {STOP}")


@contextmanager
def alone(file: Path) -> Iterator[None]:
    """Hold a SQLite database for this process alone, its log written back into the file.

    A file that is not a database, or too damaged to be locked, is let through.

    Raises:
        SetupError: another program has it open.
    """
    sqlite = sqlite_module()
    address = f"{file.absolute().as_uri()}?mode=rw"
    connection = sqlite.connect(address, uri=True, timeout=PATIENCE, isolation_level=None)
    try:
        _lock(connection, file, sqlite)
        yield
    finally:
        connection.close()


def _lock(connection: Any, file: Path, sqlite: Any) -> None:
    try:
        connection.execute("PRAGMA journal_mode=delete").fetchall()
        connection.execute("BEGIN EXCLUSIVE")
    except sqlite.OperationalError as error:
        if error.sqlite_errorname.startswith(("SQLITE_BUSY", "SQLITE_LOCKED")):
            raise SetupError(f"The database is in use: another program has {file} open. {STOP}") from None
    except sqlite.DatabaseError:
        return  # damaged


def require_unconnected(url: URL) -> None:
    """Refuse while others are connected to a PostgreSQL database.

    Raises:
        SetupError: somebody is, or it cannot be reached.
    """
    engine = create_engine(postgresql.driven(url))
    try:
        with engine.connect() as connection:
            others = others_connected(connection)
    except DBAPIError as error:
        shown = url.render_as_string()
        raise SetupError(f"The database {shown} cannot be reached: {cause(error)}.") from None
    finally:
        engine.dispose()
    if others:
        raise SetupError(
            f"The database is in use: {counted(others, 'connection')} to {url.render_as_string()}. {STOP}"
        )


def others_connected(connection: Connection) -> int:
    """Return the number of other connections to a PostgreSQL database, also later in a transaction."""
    connection.execute(text("SELECT pg_stat_clear_snapshot()"))
    number: int = connection.execute(_OTHERS).scalar_one()
    return number


# Not those of the server's own processes, such as autovacuum.
_OTHERS = text(
    "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() AND pid <> pg_backend_pid() "
    "AND backend_type = 'client backend'"
)
