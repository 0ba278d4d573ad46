"""A process's view of the commits to its store: polls look only where somebody has committed.

A worker gives a sign of life every second or two, of which it need not be told. So a sign is stored by the
connection that watches, on SQLite: that one does not count its own commits. On PostgreSQL the numbers of
transactions show that no other one has come between.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from sqlalchemy import Connection, Engine, PoolProxiedConnection
from sqlalchemy.orm import Session

from parenting.server.store import postgresql, sqlite
from parenting.server.store.guard import confirm

Seen = TypeVar("Seen")
CLOSE_SECONDS = 0.5
"""Seconds that an end waits for a transaction that goes on."""


@contextmanager
def committed(session: Session) -> Iterator[Session]:
    """Begin a transaction, and commit it at the end.

    Raises:
        GoneError: what was committed is not kept.
    """
    with session:
        with session.begin():
            info = session.connection().info  # BEGIN IMMEDIATE now, not at the first statement
            yield session
        confirm(info)  # before anybody is told


class Commits:
    """The commits to a store, as one process sees them. Threads may share it."""

    def __init__(self, engine: Engine) -> None:
        """Nothing is open yet; `engine` begins transactions that write and are not durable."""
        self._engine, self._sqlite = engine, engine.dialect.name == "sqlite"
        self._lock = threading.RLock()
        self._connection: Connection | None = None  # of SQLite
        self._watcher: PoolProxiedConnection | None = None
        self._last: tuple[int | str, Hashable, Any] | None = None

    def cached(self, key: Hashable, look: Callable[[], Seen]) -> Seen:
        """Return `look()`, or its last result under this key if nobody has committed since."""
        with self._lock:
            version = self.version()  # before the look: later commits belong to the next one
            if self._last is None or self._last[:2] != (version, key):
                self._last = (version, key, look())
            seen: Seen = self._last[2]
            return seen

    def version(self) -> int | str:
        """Return a value that changes with each commit, but for those of `unseen` on SQLite."""
        with self._lock:
            watcher = self._open()
            try:
                return sqlite.data_version(watcher) if self._sqlite else postgresql.data_version(watcher)
            except BaseException:
                self._drop()
                raise

    @contextmanager
    def unseen(self) -> Iterator[Session]:
        """Begin a transaction of SQLite that does not change the version; at its end it commits."""
        with self._lock:
            self._open()
            assert self._connection is not None
            try:
                with committed(Session(self._connection, expire_on_commit=False)) as session:
                    yield session
            except BaseException:
                self._drop()
                raise

    def forgive(self, transaction: int) -> None:
        """Pass over a commit to PostgreSQL if it is the only one since the last look."""
        with self._lock:
            if self._last is not None and self._last[0] == postgresql.snapshot_before(transaction):
                version = self.version()
                if version == postgresql.snapshot_before(transaction + 1):
                    self._last = (version, *self._last[1:])

    def close(self) -> None:
        """Close the connection that watches; one in use, which a store may hold, ends with its process."""
        if not self._lock.acquire(timeout=CLOSE_SECONDS):
            return
        try:
            if self._watcher is not None:
                self._watcher.close()
            if self._connection is not None:
                self._connection.close()
            self._watcher = self._connection = None
        finally:
            self._lock.release()

    def _open(self) -> PoolProxiedConnection:
        if self._watcher is None and self._sqlite:
            self._connection = self._engine.connect()
            self._watcher = self._connection.connection
        elif self._watcher is None:
            self._watcher = postgresql.watcher(self._engine)
        return self._watcher

    def _drop(self) -> None:
        """Have the next poll connect again, and look: each connection of SQLite counts commits for itself."""
        watcher, connection = self._watcher, self._connection
        self._watcher = self._connection = self._last = None
        if connection is not None:
            connection.invalidate()
            connection.close()
        elif watcher is not None:
            watcher.invalidate()
