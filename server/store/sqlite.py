"""SQLite: the driver, the pragmas of each connection, and BEGIN by our own hand.

Every write begins with BEGIN IMMEDIATE: a deferred transaction that reads and then writes fails at once under
another writer, whatever the busy timeout. SQLite runs in WAL with `synchronous=FULL`: after a commit nothing
is lost, power included.
"""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping
from functools import partial
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, PoolProxiedConnection, create_engine, event

from parenting.server.columns import decoded
from parenting.server.errors import SetupError
from parenting.server.store.check import require_usable
from parenting.server.store.driver import BUSY_SECONDS, can_write, open_file, sqlite_module
from parenting.server.store.guard import Guard, look
from parenting.server.store.patience import remaining
from parenting.server.store.private import close_to_others

__all__ = ["BUSY_SECONDS", "PRAGMAS", "data_version", "make_folder", "open_engine", "sqlite_module"]

PRAGMAS = {
    "journal_mode": "wal",
    "synchronous": "full",
    "foreign_keys": "on",
    "busy_timeout": str(int(BUSY_SECONDS * 1000)),
    "cache_size": "-256",  # kB of pages that each connection keeps; the system's own cache holds the file
}
KEPT, MORE = 8, 42
"""Connections that stay open while nobody uses them, and others at most, which are closed after use. Each one
keeps pages and prepared statements, so idle ones cost memory; forty threads and a few others may have one."""
CONNECT = {"cached_statements": 64}
"""Prepared statements that a connection keeps; each holds some kilobytes."""


def open_engine(url: URL, reading: bool = False, **options: Any) -> Engine:
    """Open the engine of a database file, and make its folder.

    Args:
        url: The URL of the file.
        reading: The database is only read: a copy that is read-only will do.
        options: More arguments of `create_engine`.

    Raises:
        SetupError: the URL names no file, the folder cannot be made, the file cannot be used as it is
            (`server.store.check`), or SQLite is too old to be safe.
    """
    path = _path(url)
    make_folder(path.parent)
    module = sqlite_module()
    require_usable(path, reading)
    only = reading and not can_write(path)
    if not reading:
        close_to_others(path)
    engine = create_engine(
        url,
        module=module,
        pool_size=KEPT,
        max_overflow=MORE,
        pool_use_lifo=True,  # in turn, all would fill their caches
        pool_timeout=BUSY_SECONDS,
        **({"creator": partial(open_file, path)} if only else {"connect_args": CONNECT}),
        **options,
    )
    event.listen(engine, "connect", partial(_set_up, pragmas={} if only else PRAGMAS))
    if not only:
        Guard(path).watch(engine)  # after the pragmas: by then each connection has its log open
    event.listen(engine, "begin", _begin)
    return engine


def _path(url: URL) -> Path:
    if url.database in (None, "", ":memory:") or str(url.database).startswith("file:"):
        raise SetupError(
            "PARENTING_DATABASE_URL: a database in memory is seen by one process only. Name a file by its "
            "path: sqlite:////folder/parenting.db."
        )
    return Path(str(url.database))


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


def data_version(connection: PoolProxiedConnection) -> int:
    """Return SQLite's number that changes with each commit of another connection than this one.

    So a connection that watches never writes, but for what it need not be told (`server.store.commits`).

    Raises:
        GoneError: the file that the connection has open is not at its path any more.
    """
    look(connection.info)
    cursor = connection.cursor()
    cursor.execute("PRAGMA data_version")
    number: int = cursor.fetchall()[0][0]
    return number


def _set_up(connection: Any, _record: Any, pragmas: Mapping[str, str]) -> None:
    connection.isolation_level = None  # the driver begins nothing by itself; `_begin` does
    connection.text_factory = decoded
    for name, value in pragmas.items():
        connection.execute(f"PRAGMA {name}={value}").fetchall()


def _begin(connection: Connection) -> None:
    """Begin by the driver itself: SQLAlchemy would take several times as long."""
    options, info = connection.get_execution_options(), connection.info
    driver: Any = connection.connection.dbapi_connection
    before = info.setdefault("synchronous", PRAGMAS["synchronous"])
    if (synchronous := options.get("synchronous", before)) != before:
        driver.execute(f"PRAGMA synchronous={synchronous}")
        info["synchronous"] = synchronous
    _set_patience(driver, info)
    driver.execute(f"BEGIN {options.get('begin', 'DEFERRED')}")


def _set_patience(driver: Any, info: MutableMapping[Any, Any]) -> None:
    """Wait for the lock of the file no longer than the caller may (`server.store.patience`)."""
    usual = int(PRAGMAS["busy_timeout"])
    left = int(1000 * remaining(usual / 1000))
    wanted = usual if left > 0.9 * usual else max(left, 1)  # 0 would mean: not at all
    if info.get("busy_timeout", usual) != wanted:
        driver.execute(f"PRAGMA busy_timeout={wanted}").fetchall()
        info["busy_timeout"] = wanted
