"""The two ends of a transfer: a source that nobody uses, and a target that holds nothing.

The source is read in one transaction, on one snapshot. The target is filled in one as well: until its end
there is no file under the target's name, and in PostgreSQL no row that anybody sees. So a transfer that was
stopped has left nothing and may be begun again.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, NullPool, create_engine, event, inspect, text

from parenting.server.backups import copies
from parenting.server.backups.in_use import STOP, alone, others_connected, require_stopped
from parenting.server.backups.whole import require_room, size, whole
from parenting.server.db import Database, connect
from parenting.server.errors import GoneError, SetupError
from parenting.server.migrate import VERSIONS, create_tables, newest, require_current, revision_in
from parenting.server.settings import Settings
from parenting.server.store.driver import can_write, sqlite_module
from parenting.server.store.postgresql import begin_migration, lift_limits
from parenting.server.store.refusals import cause
from parenting.server.store.url import WrongUrlError, parsed
from parenting.server.tables import Identity
from parenting.server.tables import Table as Root
from parenting.server.transfer import rows

BESIDE = ("", "-wal", "-shm", "-journal", "-mark")
"""Ends of the names of files that must not be there: the target, and files that count as its own."""
GROWTH = 2
"""A file of SQLite may take so many times the bytes of the tables that are copied into it."""


def place(named: str) -> URL:
    """Return the URL of a database that is named by its URL, or by the path of its SQLite file.

    Raises:
        SetupError: it is neither, or of another store.
    """
    if "://" not in named:
        return URL.create("sqlite", database=str(Path(named).absolute()))
    try:
        return parsed(named)
    except WrongUrlError as error:
        raise SetupError(f"{named.partition('://')[0]}://...: {error}. {_REMEDY}") from None


@contextmanager
def reaching(url: URL) -> Iterator[None]:
    """Say which end of a transfer it is that cannot be reached, and why, without its password.

    Raises:
        SetupError: it cannot be.
    """
    try:
        yield
    except GoneError as error:
        named = f"database {url.database} at {url.host or 'its socket'}"
        if url.get_backend_name() == "sqlite":
            named = f"database {url.database}"
        said = cause(error) or "it is not there, or cannot be opened"
        raise SetupError(
            f"The {named} cannot be reached: {said}. Nothing was copied. "
            "Look whether it is there, then give the command again."
        ) from None


_REMEDY = "Write the path of a file, or postgresql://user@host/database."


class Source:
    """A database that is read on one snapshot."""

    def __init__(self, db: Database, connection: Connection, snapshot: bool) -> None:
        self.db, self.connection, self._snapshot = db, connection, snapshot
        self._began = db.data_version() if self._sqlite else ""

    @property
    def _sqlite(self) -> bool:
        return self.connection.dialect.name == "sqlite"

    @property
    def bytes(self) -> int:
        """Return about how many bytes it takes."""
        if self._sqlite:
            return size(Path(str(self.db.engine.url.database)))
        found: int = self.connection.execute(text("SELECT pg_database_size(current_database())")).scalar_one()
        return found

    def require_unused(self) -> None:
        """Refuse a source that others use, unless a snapshot will do. Call it at the beginning and the end.

        Raises:
            SetupError: others are connected, or have written since the beginning.
        """
        if self._snapshot:
            return
        if self._sqlite:
            used = self.db.data_version() != self._began
        else:
            used = others_connected(self.connection) > 0
        if used:
            shown = self.db.engine.url.render_as_string()
            raise SetupError(
                f"{shown} is in use: what is stored there from now on would be missing in the target. {STOP} "
                "--snapshot copies its present moment all the same."
            )


@contextmanager
def source(url: URL, data: Path, snapshot: bool) -> Iterator[Source]:
    """Open the source, whose tables have to be those of this version.

    Args:
        url: Its URL.
        data: The data folder, where processes of this machine may live.
        snapshot: True takes one moment of a database that may be in use.

    Raises:
        SetupError: there is none, it is of another revision, damaged or in use.
    """
    folder, file = data, Path(str(url.database))
    if url.get_backend_name() == "sqlite":
        copies.require_database(file)
        folder = file.parent
        if not snapshot:
            require_stopped(folder)
            if can_write(file):
                with alone(file):
                    pass
    db = connect(Settings(data=folder, database_url=url.render_as_string(False)), reading=True)
    try:
        with reaching(url):
            require_current(db)
        with db.read() as session:
            connection = session.connection()
            if connection.dialect.name == "postgresql":
                lift_limits(connection)
            found = Source(db, connection, snapshot)
            found.require_unused()
            yield found
    finally:
        db.close()


@contextmanager
def target(url: URL, data: Path, needed: int) -> Iterator[Connection]:
    """Open a target with the tables of this version and no rows, in a transaction that commits at the end.

    Args:
        url: Its URL.
        data: The data folder.
        needed: About how many bytes will be written.

    Raises:
        SetupError: it holds something already, is in use or cannot be made.
    """
    if url.get_backend_name() == "sqlite":
        with _file(Path(str(url.database)), needed) as connection:
            yield connection
        return
    db = connect(Settings(data=data, database_url=url.render_as_string(False)))
    try:
        with reaching(url), db.read() as session:
            session.connection()
        with db.write() as session:
            connection = session.connection()
            begin_migration(connection)
            _require_empty(connection, url)
            lift_limits(connection)
            yield connection
    finally:
        db.close()


@contextmanager
def _file(file: Path, needed: int) -> Iterator[Connection]:
    for end in BESIDE:
        if Path(f"{file}{end}").exists():
            raise SetupError(f"The target is not empty: there is {file}{end}. Name another file, or move it.")
    require_room(file.parent, GROWTH * needed, "Free some space, or name a file on another disk.")
    with whole(file) as part:
        engine = create_engine("sqlite://", creator=lambda: _opened(part), poolclass=NullPool)
        event.listen(engine, "begin", lambda connection: connection.exec_driver_sql("BEGIN IMMEDIATE"))
        with engine.begin() as connection:
            create_tables(connection)
            yield connection
        copies.check(part)


def _opened(file: Path) -> Any:
    """Open a file that is thrown away unless it gets complete, so nothing of it has to survive a crash."""
    connection = sqlite_module().connect(str(file), isolation_level=None)
    for name, value in {"journal_mode": "memory", "synchronous": "off", "foreign_keys": "on"}.items():
        connection.execute(f"PRAGMA {name}={value}").fetchall()
    return connection


def _require_empty(connection: Connection, url: URL) -> None:
    shown = url.render_as_string()
    if others_connected(connection):
        raise SetupError(f"The target {shown} is in use. {STOP}")
    there = set(inspect(connection).get_table_names())
    if not there:
        create_tables(connection)
        return
    mine = {*Root.metadata.tables, VERSIONS.name}
    if not there <= mine or revision_in(connection) != newest():
        raise SetupError(
            f"The target is not empty: {shown} holds tables of another program, or of another version of "
            "Parenting. Name an empty database."
        )
    for table in Root.metadata.sorted_tables:
        if table.name != Identity.__tablename__ and (number := rows.count(connection, table)):
            raise SetupError(
                f"The target is not empty: {shown} has rows in its table {table.name} ({number}). "
                "Name an empty database."
            )
