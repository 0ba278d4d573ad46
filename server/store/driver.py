"""SQLite's driver, and one connection to a database file without SQLAlchemy."""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from typing import Any

from parenting.server.errors import SetupError

SAFE_SQLITE = (3, 51, 3)
"""Older versions can corrupt a database in WAL mode: a race between the log's reset and a checkpoint."""
BUSY_SECONDS = 5.0
IMMUTABLE = "immutable=1"
"""The mode that lets SQLite read a file without a log beside it in a folder that is read-only."""


def sqlite_module() -> Any:
    """Return SQLite's driver: `pysqlite3`, which brings its own SQLite, or Python's if that is new enough.

    Raises:
        SetupError: neither is safe.
    """
    found = "none"
    for name in ("pysqlite3.dbapi2", "sqlite3"):
        try:
            module = importlib.import_module(name)
        except ImportError:
            continue
        if module.sqlite_version_info >= SAFE_SQLITE:
            return module
        found = module.sqlite_version
    least = ".".join(map(str, SAFE_SQLITE))
    raise SetupError(
        f"SQLite {found} can corrupt a database under load; {least} or newer is needed. "
        "Run: pip install 'pysqlite3>=0.6.1'"
    )


def can_write(database: Path) -> bool:
    """Return whether this process may write a database file and the log beside it."""
    return os.access(database, os.W_OK) and os.access(database.parent, os.W_OK)


def open_file(database: Path) -> Any:
    """Connect to a database that exists, for reading only, while others may use it. Close the connection.

    It never writes a leftover log back into the file, which may be damaged.

    Raises:
        sqlite3.Error: it is not a database, or cannot be opened.
    """
    sqlite = sqlite_module()
    for mode in _modes(database):
        connection = sqlite.connect(
            f"{database.absolute().as_uri()}?{mode}",
            uri=True,
            timeout=BUSY_SECONDS,
            isolation_level=None,
            check_same_thread=False,
        )
        try:
            connection.execute("SELECT count(*) FROM sqlite_schema").fetchall()
        except sqlite.Error as error:
            connection.close()
            if mode != "mode=ro" or not _is(error, "SQLITE_CANTOPEN"):
                raise
        except BaseException:
            connection.close()
            raise
        else:
            return connection
    raise AssertionError("the last mode returns or raises")


def is_busy(error: Exception) -> bool:
    """Return whether an error of the driver says that others have locked the database."""
    return _is(error, "SQLITE_BUSY") or _is(error, "SQLITE_LOCKED")


def _modes(database: Path) -> tuple[str, ...]:
    if not can_write(database):
        return (IMMUTABLE,)
    # With a log, a connection that cannot write leaves it as it is. Without one it could not make it.
    return ("mode=ro", "mode=rw") if os.path.exists(f"{database}-wal") else ("mode=rw",)


def _is(error: Exception, name: str) -> bool:
    return str(getattr(error, "sqlite_errorname", "")).startswith(name)
