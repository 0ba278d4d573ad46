"""Copy a whole database into an empty one of the same or another store, and compare both before the end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import Connection, Table, delete

from parenting._plural import counted
from parenting.server.errors import SetupError
from parenting.server.store.refusals import translated
from parenting.server.tables import Table as Root
from parenting.server.transfer import numbers, rows
from parenting.server.transfer.ends import Source, place, source, target
from parenting.server.transfer.rows import Digest

Progress = Callable[[int, int], None]
"""A function that takes the rows that are done, and all that are to be done."""
SHOWN = {"run": "run", "query": "question", "answer": "answer", "checkpoint": "checkpoint"}


@dataclass(frozen=True)
class Copied:
    """A database that was copied."""

    target: str
    digests: dict[str, Digest]  # by table

    def __str__(self) -> str:
        """Return what a person wants to know of it."""
        counts = ", ".join(counted(self.digests[name].rows, noun) for name, noun in SHOWN.items())
        return f"{counts}; {len(self.digests)} tables, all equal"


def copy(
    from_: str, to: str, data: Path, snapshot: bool = False, progress: Progress = lambda done, total: None
) -> Copied:
    """Copy every row of a database into an empty one, with its number and public id.

    Args:
        from_: The source: the path of a SQLite file, or a URL.
        to: The target, likewise.
        data: The data folder.
        snapshot: True copies one moment of a source that is in use.
        progress: Told of rows.

    Raises:
        SetupError: an end cannot be used, a value cannot be copied, or the two are not equal. The target is
            as it was before.
    """
    old, new = place(from_), place(to)
    with translated(), source(old, data, snapshot) as found, target(new, data, found.bytes) as connection:
        digests = _copy(found, connection, progress)
        found.require_unused()
    return Copied(new.render_as_string(), digests)


def _copy(found: Source, connection: Connection, progress: Progress) -> dict[str, Digest]:
    tables = Root.metadata.sorted_tables
    for table in reversed(tables):
        connection.execute(delete(table))  # the identity that the first migration has drawn
    total = 2 * sum(rows.count(found.connection, table) for table in tables)
    done = 0

    def more(number: int) -> None:
        nonlocal done
        done += number
        progress(done, total)

    digests = {table.name: _copied(found.connection, connection, table, more) for table in tables}
    for table in tables:
        _compare(connection, table, digests[table.name], more)
    numbers.go_on_from(connection, numbers.given(found.connection))
    return digests


def _copied(old: Connection, new: Connection, table: Table, more: rows.Told) -> Digest:
    digest = Digest()
    for batch in rows.read(old, table, digest):
        rows.write(new, table, batch)
        more(len(batch))
    return digest


def _compare(new: Connection, table: Table, wanted: Digest, more: rows.Told) -> None:
    """Read what was written.

    Raises:
        SetupError: it is not what was read.
    """
    digest = Digest()
    for batch in rows.read(new, table, digest):
        more(len(batch))
    if digest != wanted:
        raise SetupError(
            f"The copy of the table {table.name} is not equal: {digest.rows} rows, {wanted.rows} in the "
            "source, or other values. Nothing was copied; report this, please."
        )
