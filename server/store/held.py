"""The file that a connection has open, compared with what is at its path.

A file that is removed, or replaced by another, stays open: SQLite would go on with it in silence, and what it
commits would be gone with the last process. So each transaction compares before it begins, before it commits
and after it has committed, which costs two `stat`s.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from parenting.server.errors import GoneError

Node = tuple[int, int]
"""A file's device and inode."""
AGAIN = "Nothing is stored meanwhile; send the same again once it is back."


class ReplacedError(GoneError):
    """Another file is at the path of the database."""


@dataclass(frozen=True)
class Held:
    """The database file, its log and its index that a connection has open."""

    path: Path
    file: Node
    log: Node | None
    index: Node | None

    # Text, since every transaction asks: a path costs more than the question.
    @cached_property
    def _name(self) -> str:
        return str(self.path)

    @cached_property
    def _log_name(self) -> str:
        return str(log_of(self.path))

    def replaced(self) -> bool:
        """Return whether another file is at the path."""
        return node(self._name) not in (None, self.file)

    def left_behind(self) -> bool:
        """Return whether the log or index of this file is still there, beside whatever file is there now.

        SQLite would take them for those of the file that is there, and destroy it.
        """
        beside = (node(log_of(self.path)), self.log), (node(index_of(self.path)), self.index)
        return any(there is not None and there == open for there, open in beside)

    def look(self) -> None:
        """Compare what is at the paths with what is open.

        Raises:
            GoneError: the database file or its log was removed, renamed or replaced.
        """
        there = node(self._name)
        if there is None:
            raise GoneError(
                f"The database file {self.path} was removed or renamed while Parenting was running. {AGAIN} "
                "Put it back where it was, or stop Parenting and restore a backup: `parenting restore`."
            )
        if there != self.file:
            raise ReplacedError(
                f"The database file {self.path} was replaced while Parenting was running. {AGAIN} "
                "Put the former file back, or restart Parenting to go on with the one that is there."
            )
        if self.log is not None and node(self._log_name) != self.log:
            raise GoneError(
                f"The log {log_of(self.path)} was removed or replaced while Parenting was running. {AGAIN} "
                "Put it back. If it is lost, stop Parenting by Ctrl-C or SIGTERM: the last process to end "
                "writes the log that it has open into the database."
            )


def node(path: str | Path) -> Node | None:
    """Return the device and inode of a file; None if there is none.

    Raises:
        GoneError: the operating system does not tell.
    """
    try:
        found = os.stat(path)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise GoneError(f"The database file {path} cannot be reached: {error.strerror}. {AGAIN}") from error
    return found.st_dev, found.st_ino


def hold(path: Path) -> Held:
    """Return what is at a path now.

    Raises:
        GoneError: nothing is.
    """
    file = node(path)
    if file is None:
        raise GoneError
    return Held(path, file, node(log_of(path)), node(index_of(path)))


def log_of(path: Path) -> Path:
    """Return the path of a database's log."""
    return Path(f"{path}-wal")


def index_of(path: Path) -> Path:
    """Return the path of the index of a database's log."""
    return Path(f"{path}-shm")
