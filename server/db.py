"""The database handle: one engine, transactions for reading and for writing, and the clock.

The stores are SQLite and PostgreSQL (`server.store`). What either says when it cannot do what it was asked
reaches callers as a `StoreError` only. A write that is not `durable` leaves its commit to the next one that
is: the log is one file, so what was committed before is on the disk with it.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Hashable, Iterator
from contextlib import AbstractContextManager, contextmanager
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TypeVar

from sqlalchemy import URL, Engine, make_url
from sqlalchemy.exc import ArgumentError
from sqlalchemy.orm import Session

from parenting.server.columns import loads
from parenting.server.errors import BusyError, GoneError, SetupError, StoreError
from parenting.server.settings import Settings
from parenting.server.store import postgresql, sqlite
from parenting.server.store.ballast import Ballast
from parenting.server.store.clock import Marks, boot_mark, server_mark
from parenting.server.store.commits import Commits, committed
from parenting.server.store.patience import remaining
from parenting.server.store.refusals import translated
from parenting.server.store.sqlite import BUSY_SECONDS
from parenting.server.store.turn import Turn

REFUSED_SECONDS = 10.0
"""A refused write counts for this long, unless another one succeeds: a full disk lets a transaction begin."""
SEEN_AT_ONCE = (BusyError, GoneError)
"""Refusals that the beginning of a transaction meets as well, so that they need not be remembered."""
Seen = TypeVar("Seen")
STORES = {"sqlite": sqlite, "postgresql": postgresql, "postgres": postgresql}


def utc_now() -> datetime:
    """Return the present time in UTC."""
    return datetime.now(UTC)


class Database:
    """The database handle.

    `read()` and `write()` are transactions; `clock()` is the time that people see, `mark(session)` the moment
    by which leases and claims are decided. With `one_writer`, a transaction that writes has the whole store.
    """

    def __init__(
        self, engine: Engine, clock: Callable[[], datetime] = utc_now, mark: Marks | None = None
    ) -> None:
        self.engine = engine
        self.clock = clock
        self._writing = engine.execution_options(begin="IMMEDIATE", synchronous="full")
        self._hurried = engine.execution_options(begin="IMMEDIATE", synchronous="normal")
        self._sqlite = self.one_writer = engine.dialect.name == "sqlite"
        self.mark: Marks = mark or (boot_mark if self._sqlite else server_mark)
        self._reading = engine if self._sqlite else postgresql.reading(engine)
        # One writer of this process at a time: fairer than many threads that sleep on SQLite's lock.
        self._turn = threading.BoundedSemaphore(1 if self._sqlite else postgresql.WRITERS)
        self._among = Turn(Path(str(engine.url.database)).parent if self._sqlite else None)
        self._commits = Commits(self._hurried)
        self._refused: tuple[StoreError, float] | None = None
        self._ballast: Ballast | None = None

    @contextmanager
    def read(self) -> Iterator[Session]:
        """Begin a transaction on one snapshot, for reading only; writes in it are refused or rolled back.

        Raises:
            StoreError: the store was busy for five seconds, refused, is gone or is damaged.
        """
        with translated(), Session(self._reading) as session:
            yield session

    @contextmanager
    def write(self, durable: bool = True) -> Iterator[Session]:
        """Begin a transaction that commits at its end; on SQLite it holds the write lock from its beginning.

        What is not `durable` may be lost with the power, but only together with all that came after it. So
        it is for what nobody was promised, or what a worker does again: leases, ticks, metrics, checkpoints.

        Raises:
            StoreError: no turn to write within five seconds, or the store refused; nothing was stored.
        """
        engine = self._writing if durable else self._hurried
        with self._noted(), self._transaction(partial(_begun, engine)) as session:
            yield session

    @contextmanager
    def _noted(self) -> Iterator[None]:
        """Take note of what the store says to a write."""
        try:
            yield
        except StoreError as error:
            self._refused = (error, time.monotonic())
            if self._ballast is not None:
                self._ballast.heed(error)
            raise
        self._refused = None

    def outlive_crash(self, session: Session) -> None:
        """Have a write that is not durable survive a crash of the store that its process lives through.

        SQLite ends only with its processes. PostgreSQL may crash alone: a worker that goes on would have
        heard an answer that counts as unheard again, and two parents would hold one question.
        """
        if not self._sqlite:
            postgresql.wait_for_log(session)

    def refusal(self) -> StoreError | None:
        """Return what the store would say to a write now; None if it is willing.

        A transaction is begun and given up; nothing is written. The caller's patience bounds the wait. What
        only a write would meet, such as a full disk, is what the last write met.
        """
        try:
            with self._transaction(partial(_begun, self._hurried)) as session:
                session.rollback()
        except StoreError as error:
            return error
        met = self.last_refusal()
        return None if isinstance(met, SEEN_AT_ONCE) else met

    def last_refusal(self) -> StoreError | None:
        """Return what the store said to the last write, if that is not long ago."""
        refused = self._refused
        if refused is None or time.monotonic() - refused[1] > REFUSED_SECONDS:
            return None
        return refused[0]

    @contextmanager
    def _transaction(self, begun: Callable[[], AbstractContextManager[Session]]) -> Iterator[Session]:
        if not self._turn.acquire(timeout=remaining(BUSY_SECONDS)):
            raise BusyError
        try:
            self._among.take()
            with translated(), begun() as session:
                yield session
        finally:
            self._among.give_back()
            self._turn.release()

    @contextmanager
    def write_unseen(self) -> Iterator[Session]:
        """Begin a transaction as `write` does, which `cached` of this process passes over; it is not durable.

        Raises:
            StoreError: no turn to write within five seconds, or the store refused; nothing was stored.
        """
        if self._sqlite:
            with self._noted(), self._transaction(self._commits.unseen) as session:
                yield session
        else:
            with self.write(durable=False) as session:
                number = postgresql.transaction_number(session)
                yield session
            with translated():
                self._commits.forgive(number)

    def cached(self, key: Hashable, look: Callable[[], Seen]) -> Seen:
        """Return `look()`, or its last result under this key if nobody has committed since.

        This is for polls: a store says cheaply whether anything was committed. Only the last result is kept.
        """
        with translated():
            return self._commits.cached(key, look)

    def data_version(self) -> int | str:
        """Return a value that changes with each commit, whoever made it, but for `write_unseen` on SQLite."""
        with translated():
            return self._commits.version()

    def keep_ballast(self) -> None:
        """Keep some disk space beside a SQLite file for the day when the disk is full."""
        if self._sqlite:
            self._ballast = Ballast(Path(str(self.engine.url.database)))
            self._ballast.keep()

    def close(self) -> None:
        """Close every connection."""
        if self._ballast is not None:
            self._ballast.close()
        self._commits.close()
        self._among.close()
        self.engine.dispose()


def _begun(engine: Engine) -> AbstractContextManager[Session]:
    return committed(Session(engine, expire_on_commit=False))


def connect(
    settings: Settings,
    clock: Callable[[], datetime] = utc_now,
    mark: Marks | None = None,
    reading: bool = False,
) -> Database:
    """Open the database of these settings. This makes the data folder, but no tables (see `server.migrate`).

    Args:
        settings: The settings that name the database.
        clock: The time.
        mark: The clock of leases and claims, for tests.
        reading: The database is only read, so that a copy that is read-only will do.

    Raises:
        SetupError: the URL cannot be read, a driver is missing, SQLite is too old to be safe, or the file is
            damaged or lacks what it held (`server.store.check`).
    """
    url = url_of(settings)
    name = url.get_backend_name()
    if name not in STORES:
        raise _unreadable(f"{name} is neither sqlite nor postgresql")
    options = {"reading": reading} if name == "sqlite" else {}
    engine = STORES[name].open_engine(url, json_serializer=_dumps, json_deserializer=loads, **options)
    return Database(engine, clock, mark)


def url_of(settings: Settings) -> URL:
    """Return the URL of the database.

    Raises:
        SetupError: it cannot be read.
    """
    try:
        return make_url(settings.url)
    except (ArgumentError, ValueError):  # its text would repeat the URL, and so its password
        raise _unreadable("this is not a URL") from None


def _unreadable(why: object) -> SetupError:
    return SetupError(
        f"PARENTING_DATABASE_URL: {why}. Write it as sqlite:////folder/parenting.db "
        "or postgresql://user@host/database."
    )


_dumps = partial(json.dumps, allow_nan=False, separators=(",", ":"))
