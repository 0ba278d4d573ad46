"""The guard of a SQLite engine: each transaction looks whether its file is there, and marks are written.

A file that was removed or renamed is waited for: once it is back, all goes on. Another file in its place is
taken only if it is the same database (by its UUID) with all that this process knows to be stored.
"""

from __future__ import annotations

import os
from collections.abc import MutableMapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, event
from sqlalchemy.exc import InvalidatePoolError

from parenting.server.errors import GoneError, SetupError
from parenting.server.store import high_water
from parenting.server.store.check import require_sound
from parenting.server.store.held import Held, hold, node
from parenting.server.store.high_water import Counts
from parenting.server.store.owner import give
from parenting.server.store.rescue import rescue

Info = MutableMapping[Any, Any]
"""Notes on a connection, which last as long as it does."""
HELD, COUNTED, GUARD = "held", "counted", "guard"


class Guard:
    """The guard of one database file and of all connections of one engine."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._held: Held | None = None  # what this process has been using
        self._counts: Counts | None = None
        self._open: set[int] = set()  # the connections, by their ids

    def watch(self, engine: Engine) -> None:
        """Look at every connection and transaction of an engine."""
        event.listen(engine, "do_connect", self._opening)
        event.listen(engine, "connect", self._opened)
        event.listen(engine, "close", lambda connection, _record: self._open.discard(id(connection)))
        event.listen(engine, "checkout", self._out)
        event.listen(engine, "begin", self._begun)
        event.listen(engine, "commit", self._committing)

    def _opening(self, _dialect: Any, _record: Any, _args: Any, _options: Any) -> None:
        """Make the file if it is new, and refuse one that came in place of what was in use."""
        there = node(self.path)
        if self._open and self._held is not None and there == self._held.file:
            self._held.look()  # a new log beside the one that is still open would be read for it
        elif self._held is None or there == self._held.file:
            if there is None:
                # SQLite gives the log the mode of the file. A file that came meanwhile is as good.
                with suppress(OSError):
                    os.close(os.open(self.path, os.O_CREAT | os.O_EXCL | os.O_RDWR | os.O_CLOEXEC, 0o600))
                    give(self.path)
        elif there is None or self._held.left_behind() or not self._is_same():
            self._held.look()
        else:
            self._held = None

    def _opened(self, connection: Any, record: Any) -> None:
        connection.execute("SELECT 1 FROM sqlite_schema").fetchall()  # opens the log
        held = hold(self.path)
        if self._held is not None and held.file != self._held.file:
            raise GoneError
        self._held = held
        record.info[GUARD], record.info[HELD] = self, held
        self._open.add(id(connection))
        self._counts = self._counts or high_water.count(connection.execute)

    def _out(self, connection: Any, record: Any, _proxy: Any) -> None:
        """Have all connections opened again where another file is at the path."""
        held: Held = record.info[HELD]
        with suppress(GoneError):
            if held.replaced():
                rescue(connection, held)  # the last moment: now they are closed
                raise InvalidatePoolError

    def _is_same(self) -> bool:
        """Return whether the file at the path is this database, with all that is known to be stored.

        Raises:
            GoneError: it is damaged, or its mark cannot be read.
        """
        if self._counts is None:
            return True
        try:
            require_sound(self.path)
            found = high_water.counted(self.path)
            mark = high_water.read(self.path)
        except SetupError as error:
            raise GoneError(error.message) from error
        known = [self._counts] if mark is None else [self._counts, mark.counts]
        return found is not None and all(
            found.database == one.database and not found.below(one) for one in known
        )

    def _begun(self, connection: Connection) -> None:
        connection.info.pop(COUNTED, None)  # of a commit that failed
        try:
            look(connection.info)
        except GoneError as error:
            kept = rescue(connection.connection.dbapi_connection, connection.info[HELD])
            if kept is None:
                raise
            raise GoneError(
                f"{error.message} What it held was copied: `parenting restore {kept} --replace`."
            ) from error

    def _committing(self, connection: Connection) -> None:
        """Look once more while nothing is committed yet, and count what a durable commit will hold."""
        connection.info[HELD].look()
        if connection.get_execution_options().get("synchronous") == "full":
            driver: Any = connection.connection.dbapi_connection
            connection.info[COUNTED] = high_water.count(driver.execute)

    def committed(self, info: Info) -> None:
        """Look whether what was committed is kept, and write the mark.

        Raises:
            GoneError: the file is not there any more, so nobody may be told that anything is stored.
        """
        held: Held = info[HELD]
        held.look()
        counts: Counts | None = info.pop(COUNTED, None)
        if counts is not None:
            self._counts = counts
            high_water.write(self.path, held, counts)


def look(info: Info) -> None:
    """Look whether the file that a connection has open is at its path; a store without a guard has none.

    Raises:
        GoneError: it is not.
    """
    if HELD in info:
        info[HELD].look()


def confirm(info: Info) -> None:
    """Confirm a commit before anybody is told of it; stores without a guard confirm by the commit itself.

    Args:
        info: The notes on the connection that committed.

    Raises:
        GoneError: what was committed is not kept.
    """
    if GUARD in info:
        info[GUARD].committed(info)
