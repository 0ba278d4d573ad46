"""The data folder and the database's file: permissions, file system, space, soundness, backups."""

from __future__ import annotations

import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from parenting.server.access.key import FILE as KEY
from parenting.server.backups.making import FOLDER
from parenting.server.backups.whole import size
from parenting.server.doctor.findings import Finding, error, ok, warning
from parenting.server.notify import SOCKETS
from parenting.server.store import high_water
from parenting.server.store.ballast import Ballast
from parenting.server.store.file_system import UNKNOWN, is_network, kind_of
from parenting.server.store.owner import way_in
from parenting.server.store.sqlite import sqlite_module

LITTLE, TOO_LITTLE = 500_000_000, 20_000_000
"""Bytes of free space below which there is a warning, or an error."""
PATIENCE = 2.0
RESTORE = "Put a backup in its place: parenting restore FILE --replace"


def permissions(data: Path, database: Path | None) -> Iterator[Finding]:
    """Look at who may read and write the data."""
    name, folder = "permissions", data.absolute()
    if not folder.exists():
        yield warning(name, f"the data folder {folder} does not exist yet", "parenting up makes it.")
        return
    if not os.access(folder, os.W_OK | os.X_OK):
        yield error(name, f"{folder} cannot be written to", way_in(folder))
        return
    if locked_out := list(_locked_out(folder, database)):
        yield from locked_out
        return
    open_to = [path for path in (folder, database) if path is not None and _others(path)]
    if open_to:
        listed = " ".join(map(str, open_to))
        yield warning(name, f"others can read {listed}", f"chmod -R go-rwx {folder}")
    elif database is not None and database.exists() and not os.access(database, os.W_OK):
        yield error(name, f"{database} cannot be written to", way_in(database))
    else:
        yield ok(name, f"{folder} is its owner's alone")


def file_system(place: Path) -> Iterator[Finding]:
    """Look for a network file system, whose locks do not hold."""
    kind = kind_of(place)
    if is_network(kind):
        yield error(
            "file system",
            f"{place} is on {kind}, a network file system",
            "Set PARENTING_DATA to a local disk.",
        )
    else:
        yield ok("file system", f"{place} is on {'an unknown file system' if kind == UNKNOWN else kind}")


def space(place: Path, database: Path | None) -> Iterator[Finding]:
    """Look at the free space, for answers and for the copy that a migration makes."""
    there = next(one for one in (place, *place.absolute().parents) if one.exists())
    free, held = shutil.disk_usage(there).free, 0 if database is None else size(database)
    said = f"{free / 1e6:.0f} MB free, the database has {held / 1e6:.1f} MB"
    if free < TOO_LITTLE:
        yield error("space", said, "Free some space: answers cannot be stored on a full disk.")
    elif free < LITTLE or free < 2 * held:
        yield warning("space", said, "Free some space: a migration needs twice the database.")
    else:
        yield ok("space", said)


def beside(database: Path) -> Iterator[Finding]:
    """Look for a log of another file, and for a mark without a database, before anything is opened."""
    mark = high_water.mark_of(database)
    if mark.exists() and not os.access(mark, os.R_OK):
        yield error("mark", f"{mark} cannot be read, so a loss would not be noticed", way_in(mark))
    elif database.is_file():
        foreign = high_water.foreign_log(database)
        if foreign is not None:
            yield error("mark", *_halves(foreign))
    elif not database.exists() and (lost := high_water.lost(database)) is not None:
        yield error("mark", *_halves(lost))


def losses(database: Path) -> Iterator[Finding]:
    """Compare a sound database with its high-water mark."""
    if (lost := high_water.lost(database)) is not None:
        yield error("mark", *_halves(lost))
    else:
        yield ok("mark", "the database lacks nothing that it held at its last durable commit")


def soundness(database: Path) -> Iterator[Finding]:
    """Read the database's file from end to end by SQLite's quick check; say how its journal is kept."""
    with closing(opened(database)) as connection:
        faults = [row[0] for row in connection.execute("PRAGMA quick_check(3)")]
        if faults != ["ok"]:
            yield error("database", f"{database} is damaged: {'; '.join(faults)}", RESTORE)
            return
        journal = connection.execute("PRAGMA journal_mode").fetchone()[0]
    yield ok("database", f"{database} is sound")
    if journal == "wal":
        yield ok("journal", "wal; commits are on the disk before they are acknowledged (synchronous=full)")
    else:
        yield ok("journal", f"{journal}; the next start changes it to wal")


def backups(place: Path) -> Iterator[Finding]:
    """Name the newest backup in the usual folder."""
    folder = place / FOLDER
    if folder.is_dir() and not os.access(folder, os.R_OK | os.X_OK):
        yield error("backups", f"{folder} cannot be read", way_in(folder))
        return
    found = [one for one in folder.glob("*") if one.suffix in (".db", ".dump")] if folder.is_dir() else []
    if found:
        newest = max(found, key=lambda one: one.stat().st_mtime)
        yield ok("backups", f"{len(found)} in {folder}, the newest is {newest.name}")
    else:
        yield ok("backups", f"none in {folder}")


def opened(database: Path) -> Any:
    """Open a database file for reading alone, without a change to it or to its log."""
    mode = "mode=ro" if Path(f"{database}-wal").exists() else "immutable=1"
    address = f"{database.absolute().as_uri()}?{mode}"
    return sqlite_module().connect(address, uri=True, timeout=PATIENCE, check_same_thread=False)


def _halves(sentences: str) -> tuple[str, str]:
    """Divide a message into what happened and the remedy, which is its last sentence."""
    said, _, remedy = sentences.rstrip(".").rpartition(". ")
    return said, f"{remedy}."


def _others(path: Path) -> bool:
    return path.exists() and bool(stat.S_IMODE(path.stat().st_mode) & 0o077)


def _locked_out(folder: Path, database: Path | None) -> Iterator[Finding]:
    """Look for what commands of another user may have made here, which locks out whoever runs the program."""
    made = [folder / FOLDER, folder / KEY, folder / SOCKETS, *(folder / SOCKETS).glob("*")]
    if database is not None:
        made += [high_water.mark_of(database), Ballast(database).path, database.parent / FOLDER]
        made += [database] if os.geteuid() == 0 else []
    for path in filter(Path.exists, dict.fromkeys(made)):
        owner = path.parent.stat().st_uid
        if os.geteuid() == 0:  # who may use everything
            if path.stat().st_uid == 0 != owner:
                said = f"{path} is root's, but its folder is not"
                yield error("permissions", said, f"chown -R {owner} {path}")
        elif not os.access(path, os.R_OK | os.W_OK | (os.X_OK if path.is_dir() else 0)):
            yield error("permissions", f"{path} cannot be used by this user", way_in(path))
