"""The rows of a table on their way from one store to another, and a digest that is equal on both.

JSON travels as the text that it is, so that not even the order of its keys changes. All else is read and
written by the types of the columns, which refuse values that are damaged.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from sqlalchemy import JSON, Column, Connection, Table, Text, bindparam, cast, func, insert, select
from sqlalchemy.exc import DBAPIError, StatementError

from parenting.server.columns import Blob, Damaged, Json, Real, Words
from parenting.server.errors import SetupError

BATCH_ROWS, BATCH_BYTES = 100, 4_000_000
"""Rows and bytes of blobs that are in memory at once; a blob that is larger comes alone."""

_JSON = JSON().with_variant(Text(), "sqlite")
"""The type that text becomes where it is stored as JSON; SQLite stores the text."""
Row = Sequence[Any]
Told = Callable[[int], None]
"""A function that is told of so many more rows."""


@dataclass
class Digest:
    """The number of a table's rows and the hash of all their values, in the order of its key."""

    rows: int = 0
    _hash: Any = field(default_factory=hashlib.sha256)

    def add(self, row: Row) -> None:
        """Take in a row."""
        self.rows += 1
        for value in row:
            written = value if isinstance(value, bytes) else _written(value)
            self._hash.update(b"%s %d:" % (type(value).__name__.encode(), len(written)))
            self._hash.update(written)

    def __eq__(self, other: object) -> bool:
        """Return whether two tables had equal rows."""
        return isinstance(other, Digest) and (self.rows, self.sha256) == (other.rows, other.sha256)

    __hash__ = object.__hash__

    @property
    def sha256(self) -> str:
        """Return the hash up to now."""
        digest: str = self._hash.hexdigest()
        return digest


def read(connection: Connection, table: Table, digest: Digest) -> Iterator[Sequence[Row]]:
    """Yield the rows of a table in batches of a bounded size, and take each into a digest.

    Raises:
        SetupError: a value cannot be read.
    """
    wanted = select(*(_read(column) for column in table.columns)).order_by(*table.primary_key.columns)
    real = [isinstance(column.type, Real) for column in table.columns]
    options = {"stream_results": True, "yield_per": _at_once(connection, table)}
    with connection.execute(wanted, execution_options=options) as found:
        for part in found.partitions():
            batch = [
                tuple(float(value) if wide and isinstance(value, int) else value for value, wide in pairs)
                for pairs in (list(zip(row, real, strict=True)) for row in part)
            ]
            for row in batch:
                _refuse_damaged(table, row)
                digest.add(row)
            yield batch


def write(connection: Connection, table: Table, batch: Sequence[Row]) -> None:
    """Write rows into a table.

    Raises:
        SetupError: the store refuses a value.
    """
    names = [column.name for column in table.columns]
    into = insert(table).values({column.name: _written_as(column) for column in table.columns})
    try:
        connection.execute(into, [dict(zip(names, row, strict=True)) for row in batch])
    except (DBAPIError, StatementError) as error:
        reason = str(error.orig or error).strip().splitlines()[0]
        raise SetupError(
            f"Rows of the table {table.name} cannot be stored in the target: {reason}. Nothing was copied. "
            "`parenting doctor` looks for damaged rows in the source."
        ) from None


def count(connection: Connection, table: Table) -> int:
    """Return the number of a table's rows."""
    number: int = connection.execute(select(func.count()).select_from(table)).scalar_one()
    return number


def _written(value: Any) -> bytes:
    if isinstance(value, datetime):
        return value.isoformat().encode()
    return (value if isinstance(value, str) else repr(value)).encode()


def _at_once(connection: Connection, table: Table) -> int:
    """Return how many rows to have in memory at once."""
    blobs = [column for column in table.columns if isinstance(column.type, Blob)]
    if not blobs:
        return BATCH_ROWS
    largest = connection.execute(select(*(func.max(func.length(blob)) for blob in blobs))).one()
    return max(1, min(BATCH_ROWS, BATCH_BYTES // (1 + sum(size or 0 for size in largest))))


def _read(column: Column[Any]) -> Any:
    return cast(column, Words()) if isinstance(column.type, Json) else column


def _written_as(column: Column[Any]) -> Any:
    if isinstance(column.type, Json):
        return cast(bindparam(column.name, type_=Text()), _JSON)
    return bindparam(column.name, type_=column.type)


def _refuse_damaged(table: Table, row: Row) -> None:
    for column, value in zip(table.columns, row, strict=True):
        if isinstance(value, Damaged):
            key = ", ".join(
                f"{one.name} {part!r}"
                for one, part in zip(table.columns, row, strict=True)
                if one.primary_key and not isinstance(part, Damaged)
            )
            raise SetupError(
                f"A stored value cannot be read: {table.name}.{column.name} {value.reason} ({key}). Nothing "
                "was copied. `parenting doctor` looks for such rows; restore a backup of before the damage."
            )
