"""Copies of a SQLite database, made by SQLite's own backup interface while others read and write.

A plain copy of the file misses what is only in the log beside it, and mixes moments. Here one read
transaction counts the rows and copies the pages, so a copy is the database of one moment: it holds every
answer that was acknowledged before the copy began.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from parenting._plural import counted
from parenting.server.backups.ended import statements
from parenting.server.errors import SetupError
from parenting.server.store.driver import open_file, sqlite_module
from parenting.server.store.sqlite import BUSY_SECONDS

HEAD = b"SQLite format 3\0"
TABLES = ("run", "query", "answer", "event", "metric", "checkpoint", "weights")
"""The tables that every backup has."""
COUNTED = (*TABLES, "checkpoint_part")
"""The tables whose rows a copy is checked for, where it has them: backups of older versions lack some."""


@dataclass(frozen=True)
class Contents:
    """The contents of a database, in few numbers."""

    revision: str | None  # of the migrations
    rows: dict[str, int]  # by table; older revisions lack some

    def __str__(self) -> str:
        """Return what a person wants to know of a backup."""
        counts = ", ".join(counted(self.rows.get(name, 0), name) for name in _SHOWN)
        return f"{counts}; revision {self.revision}"


_SHOWN = ("run", "answer", "checkpoint")


def copy(source: Path, target: Path) -> Contents:
    """Copy a database that may be in use into a new file, and return what the copy has to hold.

    The copy has no log beside it. It is not on the disk until `target` is synced.

    Raises:
        SetupError: `source` is not a database, or one of the two cannot be used.
    """
    try:
        with closing(open_file(source)) as old, _connected(target, "mode=rwc") as new:
            old.execute("BEGIN")
            told = _contents(old)
            old.backup(new)
            new.execute("PRAGMA journal_mode=delete").fetchall()  # one file, whatever the source's journal is
            old.execute("ROLLBACK")
            return told
    except sqlite_module().Error as error:
        raise SetupError(
            f"{source} cannot be copied: {error}. If it is damaged, put a backup in its place: "
            "parenting restore FILE --replace"
        ) from None


def end_access(file: Path) -> None:
    """End the sessions and tokens of a copy that nobody has open yet (`ended`).

    Raises:
        SetupError: it is damaged.
    """
    try:
        with _connected(file, "mode=rw") as database:
            for statement in statements(_tables(database)):
                database.execute(statement)
    except sqlite_module().Error as error:
        raise SetupError(f"{file} is damaged: {error}. Use another backup.") from None


def check(file: Path) -> Contents:
    """Read a database that nobody has open from end to end, and return its contents.

    Raises:
        SetupError: it is not a database, or is damaged.
    """
    try:
        with _connected(file, "immutable=1") as database:
            faults = [row[0] for row in database.execute("PRAGMA integrity_check(3)")]
            if faults != ["ok"]:
                raise SetupError(f"{file} is damaged: {'; '.join(faults)}. Use another backup.")
            if orphan := database.execute("PRAGMA foreign_key_check").fetchone():
                raise SetupError(f"{file} is damaged: a row of {orphan[0]} names none of {orphan[2]}.")
            return _contents(database)
    except sqlite_module().Error as error:
        raise SetupError(f"{file} is damaged: {error}. Use another backup.") from None


def require_database(file: Path) -> None:
    """Refuse a file that is not an SQLite database.

    Raises:
        SetupError: there is none, it cannot be read, or it is something else.
    """
    try:
        with file.open("rb") as opened:
            begins = opened.read(len(HEAD))
    except OSError as error:
        raise SetupError(f"{file} cannot be read: {error.strerror}. Name a file that is there.") from None
    if begins[:5] == b"PGDMP":
        raise SetupError(f"{file} is a dump of PostgreSQL; PARENTING_DATABASE_URL names no such database.")
    if begins != HEAD:
        raise SetupError(f"{file} is not an SQLite database. Name a file that `parenting backup` wrote.")


def _contents(database: Any) -> Contents:
    there = _tables(database)
    revision = None
    if "alembic_version" in there:
        found = database.execute("SELECT version_num FROM alembic_version").fetchone()
        revision = None if found is None else str(found[0])
    counted = [name for name in COUNTED if name in there]
    rows = {name: database.execute(f"SELECT count(*) FROM {name}").fetchone()[0] for name in counted}
    return Contents(revision, rows)


def _tables(database: Any) -> set[str]:
    return {row[0] for row in database.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")}


@contextmanager
def _connected(file: Path, mode: str) -> Iterator[Any]:
    """Open a file without SQLAlchemy."""
    address = f"{file.absolute().as_uri()}?{mode}"
    connection = sqlite_module().connect(address, uri=True, timeout=BUSY_SECONDS, isolation_level=None)
    try:
        yield connection
    finally:
        connection.close()
