"""The last copy of a database file that was removed for good while this process has it open.

Its blocks stay on the disk until the last process closes it. What was confirmed before is in them, so it is
copied into the folder of backups before anything is closed.
"""

from __future__ import annotations

import os
import threading
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from parenting.server.store.driver import sqlite_module
from parenting.server.store.held import Held, Node
from parenting.server.store.owner import give

FOLDER = "backups"
DESCRIPTORS = Path("/proc/self/fd")
_alone = threading.Lock()


def rescue(connection: Any, held: Held) -> Path | None:
    """Copy a file that has no name left, once, and return the copy; None if it has one or cannot be copied.

    Args:
        connection: A connection of SQLite's driver that has the file open, without a transaction.
        held: The file, which is not at its path any more.
    """
    target = held.path.parent / FOLDER / f"rescued-{held.file[1]}.db"
    with _alone:
        if not _is_unlinked(held.file) or not held.path.parent.is_dir():
            return None
        if target.exists():
            return target
        part = target.with_name(f"{target.name}.{os.getpid()}")
        try:
            target.parent.mkdir(exist_ok=True, mode=0o700)
            os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, 0o600))
            give(target.parent, part)
            with closing(sqlite_module().connect(str(part), isolation_level=None)) as copy:
                connection.backup(copy)
                copy.execute("PRAGMA journal_mode=delete").fetchall()  # one file
            _sync(part)
            part.replace(target)
            _sync(target.parent)
        except (OSError, sqlite_module().Error):
            return None
        finally:
            with suppress(OSError):
                part.unlink(missing_ok=True)
        return target


def _is_unlinked(file: Node) -> bool:
    """Return whether a file that this process has open has no name left, as Linux tells it.

    Opening the file to ask would give up SQLite's locks on it when it is closed.
    """
    with suppress(OSError):
        for name in os.listdir(DESCRIPTORS):
            with suppress(OSError):
                found = os.stat(DESCRIPTORS / name)
                if (found.st_dev, found.st_ino) == file:
                    return found.st_nlink == 0
    return False


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
