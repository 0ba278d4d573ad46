"""SQLite: the driver, the pragmas of each connection, and BEGIN by our own hand.

Every write begins with BEGIN IMMEDIATE: a deferred transaction that reads and then writes fails at once under
another writer, whatever the busy timeout. SQLite runs in WAL with `synchronous=FULL`: after a commit nothing
is lost, power included.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, PoolProxiedConnection, create_engine, event

from parenting.server.columns import decoded
from parenting.server.errors import SetupError
from parenting.server.store.patience import remaining

SAFE_SQLITE = (3, 51, 3)
"""Older versions can corrupt a database in WAL mode: a race between the log's reset and a checkpoint."""
BUSY_SECONDS = 5.0
PRAGMAS = {
    "journal_mode": "wal",
    "synchronous": "full",
    "foreign_keys": "on",
    "busy_timeout": str(int(BUSY_SECONDS * 1000)),
}


def open_engine(url: URL, **options: Any) -> Engine:
    """Open the engine of a database file, and make its folder.

    Raises:
        SetupError: the URL names no file, the folder cannot be made, or SQLite is too old to be safe.
    """
    if url.database in (None, "", ":memory:"):
        raise SetupError(
            "PARENTING_DATABASE_URL: a database in memory is seen by one process only. Name a file."
        )
    make_folder(Path(str(url.database)).parent)
    engine = create_engine(
        url,
        module=sqlite_module(),
        pool_size=20,
        max_overflow=30,
        pool_timeout=BUSY_SECONDS,
        **options,
    )
    event.listen(engine, "connect", _set_up)
    event.listen(engine, "begin", _begin)
    return engine


def make_folder(folder: Path) -> None:
    """Make the data folder, readable by its owner only.

    Raises:
        SetupError: it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError as error:
        raise SetupError(
            f"The data folder {folder} cannot be made: {error.strerror}. Set PARENTING_DATA to another one."
        ) from None


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


def watcher(engine: Engine) -> PoolProxiedConnection:
    """Return a connection for `data_version`. It never writes, so every commit is another's."""
    return engine.raw_connection()


def data_version(connection: Any) -> int:
    """Return SQLite's number that changes with each commit of another connection than this one."""
    cursor = connection.cursor()
    cursor.execute("PRAGMA data_version")
    number: int = cursor.fetchall()[0][0]
    return number


def _set_up(connection: Any, _record: Any) -> None:
    connection.isolation_level = None  # the driver begins nothing by itself; `_begin` does
    connection.text_factory = decoded
    for name, value in PRAGMAS.items():
        connection.execute(f"PRAGMA {name}={value}").fetchall()


def _begin(connection: Connection) -> None:
    options = connection.get_execution_options()
    before = connection.info.setdefault("synchronous", PRAGMAS["synchronous"])
    if (synchronous := options.get("synchronous", before)) != before:
        connection.exec_driver_sql(f"PRAGMA synchronous={synchronous}")
        connection.info["synchronous"] = synchronous
    _set_patience(connection)
    connection.exec_driver_sql(f"BEGIN {options.get('begin', 'DEFERRED')}")


def _set_patience(connection: Connection) -> None:
    """Wait for the lock of the file no longer than the caller may (`server.store.patience`)."""
    usual = int(PRAGMAS["busy_timeout"])
    left = int(1000 * remaining(usual / 1000))
    wanted = usual if left > 0.9 * usual else max(left, 1)  # 0 would mean: not at all
    if connection.info.get("busy_timeout", usual) != wanted:
        connection.exec_driver_sql(f"PRAGMA busy_timeout={wanted}")
        connection.info["busy_timeout"] = wanted
