"""The database handle: one engine, transactions for reading and for writing, and the clock.

Every write begins with BEGIN IMMEDIATE: a deferred transaction that reads and then writes fails at once under
another writer, whatever the busy timeout. SQLite runs in WAL with `synchronous=FULL`: after a commit nothing
is lost, power included. A write that is not `durable` leaves its commit to the next one that is: the log is
one file, so what was committed before is on the disk with it.
"""

from __future__ import annotations

import importlib
import json
import threading
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from sqlalchemy import Connection, Engine, PoolProxiedConnection, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, NoSuchModuleError, OperationalError
from sqlalchemy.orm import Session

from parenting.server.columns import decoded, loads
from parenting.server.errors import BusyError, DiskFullError, SetupError
from parenting.server.settings import Settings

SAFE_SQLITE = (3, 51, 3)
"""Older versions can corrupt a database in WAL mode: a race between the log's reset and a checkpoint."""
BUSY_SECONDS = 5.0
Seen = TypeVar("Seen")
PRAGMAS = {
    "journal_mode": "wal",
    "synchronous": "full",
    "foreign_keys": "on",
    "busy_timeout": str(int(BUSY_SECONDS * 1000)),
}


def utc_now() -> datetime:
    """Return the present time in UTC."""
    return datetime.now(UTC)


class Database:
    """The database handle. `read()` and `write()` are transactions; `clock()` is the time."""

    def __init__(self, engine: Engine, clock: Callable[[], datetime] = utc_now) -> None:
        self.engine = engine
        self.clock = clock
        self._writing = engine.execution_options(begin="IMMEDIATE", synchronous="full")
        self._hurried = engine.execution_options(begin="IMMEDIATE", synchronous="normal")
        # One writer of this process at a time: fairer than many threads that sleep on SQLite's lock.
        self._turn = threading.Lock()
        self._cache_lock = threading.Lock()
        self._watcher: PoolProxiedConnection | None = None
        self._last: tuple[int, Hashable, Any] | None = None

    @contextmanager
    def read(self) -> Iterator[Session]:
        """Begin a deferred transaction, for reading only; writes in it are rolled back.

        Raises:
            BusyError: the database was locked for five seconds.
        """
        with _translated_errors(), Session(self.engine) as session:
            yield session

    @contextmanager
    def write(self, durable: bool = True) -> Iterator[Session]:
        """Begin a transaction that holds the write lock from its beginning and commits at its end.

        What is not `durable` may be lost with the power, but only together with all that came after it. So
        it is for what nobody was promised, or what a worker does again: leases, ticks, metrics, checkpoints.

        Raises:
            BusyError: no turn to write within five seconds.
            DiskFullError: nothing was stored.
        """
        if not self._turn.acquire(timeout=BUSY_SECONDS):
            raise BusyError
        try:
            engine = self._writing if durable else self._hurried
            with _translated_errors(), Session(engine, expire_on_commit=False) as session, session.begin():
                session.connection()  # BEGIN IMMEDIATE now, not at the first statement
                yield session
        finally:
            self._turn.release()

    def cached(self, key: Hashable, look: Callable[[], Seen]) -> Seen:
        """Return `look()`, or its last result under this key if nobody has committed since.

        This is for polls: SQLite says cheaply whether anything was committed. Only the last result is kept.
        """
        with self._cache_lock:
            version = self.data_version()  # before the look: later commits belong to the next one
            if version is None:
                return look()
            if self._last is None or self._last[:2] != (version, key):
                self._last = (version, key, look())
            seen: Seen = self._last[2]
            return seen

    def data_version(self) -> int | None:
        """Return SQLite's number that changes with each commit of another connection; None elsewhere."""
        if self.engine.dialect.name != "sqlite":
            return None
        with _translated_errors():
            if self._watcher is None:
                self._watcher = self.engine.raw_connection()  # never writes: every commit is another's
            cursor = self._watcher.cursor()
            cursor.execute("PRAGMA data_version")
            number: int = cursor.fetchall()[0][0]
            return number

    def close(self) -> None:
        """Close every connection."""
        if self._watcher is not None:
            self._watcher.close()
            self._watcher = None
        self.engine.dispose()


def connect(settings: Settings, clock: Callable[[], datetime] = utc_now) -> Database:
    """Open the database of these settings. This makes the data folder, but no tables (see `server.migrate`).

    Raises:
        SetupError: the URL cannot be read, a driver is missing, or SQLite is too old to be safe.
    """
    try:
        url = make_url(settings.url)
        if url.get_backend_name() != "sqlite":
            return Database(
                create_engine(url, json_serializer=_dumps, json_deserializer=loads, pool_pre_ping=True), clock
            )
    except (ArgumentError, NoSuchModuleError, ImportError) as error:
        raise SetupError(
            f"PARENTING_DATABASE_URL: {error}. Write it as sqlite:////folder/parenting.db."
        ) from None
    if url.database in (None, "", ":memory:"):
        raise SetupError(
            "PARENTING_DATABASE_URL: a database in memory is seen by one process only. Name a file."
        )
    make_folder(Path(str(url.database)).parent)
    engine = create_engine(
        url,
        module=sqlite_module(),
        json_serializer=_dumps,
        json_deserializer=loads,
        pool_size=20,
        max_overflow=30,
        pool_timeout=BUSY_SECONDS,
    )
    event.listen(engine, "connect", _set_up)
    event.listen(engine, "begin", _begin)
    return Database(engine, clock)


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
    connection.exec_driver_sql(f"BEGIN {options.get('begin', 'DEFERRED')}")


@contextmanager
def _translated_errors() -> Iterator[None]:
    try:
        yield
    except OperationalError as error:
        name = str(getattr(error.orig, "sqlite_errorname", ""))
        if name.startswith(("SQLITE_BUSY", "SQLITE_LOCKED")):
            raise BusyError from error
        if name.startswith("SQLITE_FULL"):
            raise DiskFullError from error
        raise


_dumps = partial(json.dumps, allow_nan=False, separators=(",", ":"))
