"""The high-water mark of a database file: what it held at its last durable commit, noted in a file beside it.

SQLite itself cannot know that its log (`-wal`) was removed while nobody had it open: what was committed last
is then gone in silence. The mark knows. It may lag behind the database but is never above what is on the
disk: a durable transaction counts its own rows before it commits, and the mark is written after the commit.
So no crash, power cut or full disk makes it wrong; a mark that cannot be written lags.

A mark belongs to one file (its inode) of one database (its UUID). A copy or a restored backup is another
file, so the mark of the former one says nothing about it.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from parenting._plural import counted as number_of
from parenting.server.errors import SetupError
from parenting.server.store.driver import open_file, sqlite_module
from parenting.server.store.held import Held, hold, log_of
from parenting.server.store.owner import give, way_in

LENGTH = 200
"""Bytes of a mark, always the same, so that it is written over in one piece."""
HEAD = "parenting-mark-2"
FORMER = "parenting-mark-1"
"""The head of marks that did not count answers of deleted runs: they are lower, so they hold, too."""
NOUNS = {"answers": "answer", "questions": "question", "runs": "run"}
COUNT = """
    SELECT uuid,
        (SELECT coalesce(max(id), 0) FROM answer) + coalesce(sum(answers) FILTER (WHERE gone), 0),
        max(last_query, (SELECT coalesce(max(id), 0) FROM query)),
        max(last_run, (SELECT coalesce(max(id), 0) FROM run)),
        coalesce(sum(answers) FILTER (WHERE NOT gone), 0)
    FROM database_identity LEFT JOIN (
        SELECT gone IS NOT NULL AS gone, json_extract(held, '$.answers') AS answers
        FROM tombstone WHERE json_valid(held))
"""
"""Numbers of answers are given again after the last ones were deleted; a tombstone counts on for them."""


@dataclass(frozen=True)
class Counts:
    """The UUID of a database and its numbers, which only grow: rows that are deleted keep theirs."""

    database: str
    answers: int
    questions: int
    runs: int
    leaving: int = 0  # answers of runs that are being deleted: there, or gone without a loss

    def below(self, other: Counts) -> dict[str, int]:
        """Return by how much each number is below another's."""
        here = {name: getattr(self, name) for name in NOUNS}
        here["answers"] += self.leaving
        lacks = {name: getattr(other, name) - here[name] for name in NOUNS}
        return {name: lack for name, lack in lacks.items() if lack > 0}


@dataclass(frozen=True)
class Mark:
    """The counts of one file of a database, whose log was this one."""

    inode: int
    log: int  # the inode of the log, 0 for none
    counts: Counts


def mark_of(database: Path) -> Path:
    """Return the file that holds the mark of a database."""
    return Path(f"{database}-mark")


def count(execute: Callable[[str], Any]) -> Counts | None:
    """Count in the transaction that is open; None where the tables are older than the database's UUID.

    Args:
        execute: The method of a connection or cursor of SQLite's driver.
    """
    try:
        row = execute(COUNT).fetchone()
    except sqlite_module().OperationalError as error:
        if str(error).startswith("no such"):
            return None
        raise
    if row is None or row[0] is None:
        return None
    return Counts(str(row[0]), *map(int, row[1:]))


def write(database: Path, held: Held, counts: Counts) -> None:
    """Write the mark over the one before. One that cannot be written is left behind: it lags."""
    inodes = f"{held.file[1]} {held.log[1] if held.log else 0}"
    words = f"{HEAD} {inodes} {counts.database} {counts.answers} {counts.questions} {counts.runs}"
    line = f"{words} {zlib.crc32(words.encode()):08x}".ljust(LENGTH - 1) + "\n"
    with suppress(OSError):
        descriptor = os.open(mark_of(database), os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            os.pwrite(descriptor, line.encode(), 0)
        finally:
            os.close(descriptor)
        give(mark_of(database))


def read(database: Path) -> Mark | None:
    """Return the mark of a database; None if there is none, or a power cut left only a part of it.

    Raises:
        SetupError: it cannot be read.
    """
    for _ in range(3):  # another process may be writing it
        with suppress(FileNotFoundError, NotADirectoryError, ValueError):
            words, _, told = _text(mark_of(database)).strip().rpartition(" ")
            head, inode, log, uuid, *numbers = words.split(" ")
            if head in (HEAD, FORMER) and told == f"{zlib.crc32(words.encode()):08x}":
                answers, questions, runs = map(int, numbers)
                return Mark(int(inode), int(log), Counts(uuid, answers, questions, runs))
    return None


def _text(mark: Path) -> str:
    """Return the text of a mark; one that cannot be read must not pass for none.

    Raises:
        SetupError: it cannot be read.
    """
    try:
        return mark.read_text("ascii")
    except (FileNotFoundError, NotADirectoryError):
        raise
    except OSError as error:
        remedy = f"Give it to this user: chown {os.geteuid()} {mark}"
        raise SetupError(
            f"The mark {mark} of the database cannot be read: {error.strerror}. {remedy}"
        ) from None


def lagging(database: Path) -> str | None:
    """Return a sentence if this user cannot write the mark of a database, which then lags; else None."""
    mark = mark_of(database)
    if not mark.exists() or os.access(mark, os.W_OK):
        return None
    return (
        f"The mark {mark} of the database cannot be written, so a loss of what is stored from now on would "
        f"not be noticed. {way_in(mark)}"
    )


def lost(database: Path) -> str | None:
    """Return a sentence if a database lacks what it held at its last durable commit, else None.

    Raises:
        SetupError: its mark cannot be read.
    """
    mark = read(database)  # first: the database only grows meanwhile
    if mark is None:
        return None
    try:
        inode = database.stat().st_ino
    except FileNotFoundError:
        return (
            f"The database {database} is missing: it held {_listed(vars(mark.counts))}. Put it back, restore "
            f"a backup (`parenting restore`), or begin with an empty one: `parenting doctor --accept`."
        )
    if inode != mark.inode:
        return None
    found = counted(database)
    if found is None or found.database != mark.counts.database:
        return None
    lacks = found.below(mark.counts)
    if not lacks:
        return None
    return (
        f"The database {database} lacks the last {_listed(lacks)} that it held. Its log {database}-wal was "
        "removed, or an older state was written over it. Put the log back before anything else is started, "
        "restore a backup (`parenting restore`), or go on without them: `parenting doctor --accept`."
    )


def foreign_log(database: Path) -> str | None:
    """Return a sentence if another file was put beside the log of the one before, else None.

    Raises:
        SetupError: its mark cannot be read.
    """
    mark, log = read(database), log_of(database)
    if mark is None or database.stat().st_ino == mark.inode:
        return None
    with suppress(OSError):
        found = log.stat()
        if found.st_ino == mark.log and found.st_size:
            return (
                f"The log {log} belongs to the database file that was at {database} before, and would "
                f"destroy the one that is there now. Put the former file back, or move {log} "
                f"and {database}-shm away."
            )
    return None


def counted(database: Path) -> Counts | None:
    """Open a database and count; None where its tables are older than its UUID, or there are none."""
    with closing(open_file(database)) as connection:
        return count(connection.execute)


def accept(database: Path) -> None:
    """Take what a database holds now as all that it ever held. After this no loss is reported any more.

    Raises:
        SetupError: the database is damaged, or the mark cannot be removed.
    """
    try:
        found = counted(database) if database.exists() and database.stat().st_size else None
        mark_of(database).unlink(missing_ok=True)
    except (OSError, sqlite_module().Error) as error:
        raise SetupError(
            f"{database} cannot be accepted: {error}. Put a backup in its place: `parenting restore`."
        ) from None
    if found is not None:
        write(database, hold(database), found)


def _listed(numbers: dict[str, Any]) -> str:
    said = [(numbers[name], noun) for name, noun in NOUNS.items() if numbers.get(name)]
    named = [number_of(number, noun) for number, noun in said]
    return " and ".join(filter(None, [", ".join(named[:-1]), *named[-1:]])) or "nothing yet"
