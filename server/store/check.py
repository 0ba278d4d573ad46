"""The check of a database file before it is used: a sentence with the way to the backup, never a traceback.

A file of up to `WHOLE_BYTES` is read whole, by SQLite's quick_check: every page and every tree of pages. Of
a larger file its header, its length and its schema are read. The content of rows is not looked at: a row that
cannot be read costs that row alone (`server.columns`).
"""

from __future__ import annotations

import re
from contextlib import closing
from pathlib import Path
from typing import Any

from parenting.server.errors import SetupError
from parenting.server.store import high_water
from parenting.server.store.driver import can_write, is_busy, open_file, sqlite_module
from parenting.server.store.file_system import is_network, kind_of
from parenting.server.store.held import log_of

WHOLE_BYTES = 64 * 1024 * 1024
"""The largest file that is read whole; it takes a fraction of a second."""
OF_ROWS = re.compile(r"CHECK constraint failed in |\S+ value in \S+$")
"""Faults of values, which are their rows' own."""
REMEDY = "Put a backup in its place: `parenting restore FILE --replace`."


def require_usable(database: Path, reading: bool = False) -> None:
    """Refuse to start on a file that is damaged, lost its last commits or cannot be written.

    Args:
        database: The path of a database; a file that does not exist yet is good, if none was there before.
        reading: It is only read, so it need not be writable.

    Raises:
        SetupError: the sentence names the remedy.
    """
    if database.is_dir():
        raise SetupError(
            f"{database} is a folder, but the database is a file. Name another one: PARENTING_DATA."
        )
    if not reading:
        _require_local(database)
    if database.exists():
        _require_access(database, reading)
        if (sentence := high_water.foreign_log(database)) is not None:
            raise SetupError(sentence)  # before SQLite sees the two together
        require_sound(database)
    if (sentence := _lost(database)) is not None:
        raise SetupError(sentence)


def require_sound(database: Path) -> None:
    """Refuse a file that is damaged or not an SQLite database.

    An empty file is a database without tables only where nothing was ever in it.

    Raises:
        SetupError: the sentence names the remedy.
    """
    length, log = database.stat().st_size, log_of(database)
    if length <= 1:
        # Never let SQLite see this: it takes one byte for none, and removes the log of an empty file.
        if not length and high_water.read(database) is None and not (log.exists() and log.stat().st_size):
            return
        raise SetupError(f"The database {database} is empty, but it held something. {REMEDY}")
    sqlite = sqlite_module()
    try:
        with closing(open_file(database)) as connection:
            faults = _schema_faults(connection) or _faults(connection, database)
    except sqlite.Error as error:
        if is_busy(error):
            return  # in use, so others can read it
        if getattr(error, "sqlite_errorname", "") == "SQLITE_NOTADB":
            raise SetupError(
                f"{database} is damaged or the file of another program: it is not an SQLite database. "
                f"{REMEDY}"
            ) from None
        raise _damaged(database, str(error)) from None
    if faults:
        raise _damaged(database, faults[0].splitlines()[-1])
    if _ends_amid_a_page(database, log):
        raise _damaged(database, "it ends in the middle of a page")


def _schema_faults(connection: Any) -> list[str]:
    """Return what is wrong with the text of the schema: the driver could not even name its columns."""
    for (definition,) in connection.execute(
        "SELECT CAST(sql AS BLOB) FROM sqlite_schema WHERE sql IS NOT NULL"
    ):
        try:
            bytes(definition).decode()
        except UnicodeDecodeError:
            return ["the definition of a table cannot be read"]
    return []


def _ends_amid_a_page(database: Path, log: Path) -> bool:
    """Return whether the last page is cut: SQLite reads zeros there. A log may hold what is missing."""
    if log.exists() and log.stat().st_size:
        return False
    with database.open("rb") as file:
        header = file.read(18)
    page = int.from_bytes(header[16:18], "big")
    return database.stat().st_size % (65536 if page == 1 else page) != 0


def _faults(connection: Any, database: Path) -> list[str]:
    """Return what is wrong with the pages; SQLite itself refuses a file shorter than its header says."""
    if database.stat().st_size > WHOLE_BYTES:
        return []
    connection.execute("PRAGMA ignore_check_constraints = on")
    found = [str(row[0]) for row in connection.execute("PRAGMA quick_check(1000)")]
    return [fault for fault in found if fault != "ok" and not OF_ROWS.match(fault)]


def _damaged(database: Path, fault: str) -> SetupError:
    return SetupError(f"The database {database} is damaged: {fault}. {REMEDY}")


def _lost(database: Path) -> str | None:
    sqlite = sqlite_module()
    try:
        return high_water.lost(database)
    except sqlite.Error as error:
        if is_busy(error):
            return None
        raise _damaged(database, str(error)) from None


def _require_local(database: Path) -> None:
    """Refuse a network file system, whose locks do not hold."""
    kind = kind_of(database.parent)
    if is_network(kind):
        raise SetupError(
            f"{database} is on {kind}, a file system that other machines write to as well. SQLite would lose "
            "answers there. Set PARENTING_DATA to a folder of a local disk."
        )


def _require_access(database: Path, reading: bool) -> None:
    if can_write(database):
        return
    if not reading:
        raise SetupError(
            f"The database {database} cannot be written: give this user the right to write the file and its "
            "folder, or name another one by PARENTING_DATA. A copy that is read-only can be listed, exported "
            "and replayed."
        )
    log = log_of(database)
    if log.exists() and log.stat().st_size:
        raise SetupError(
            f"{database} is read-only, and its log {log} holds what is not in it yet. Copy both into a "
            "folder of yours, and name it by PARENTING_DATA."
        )
