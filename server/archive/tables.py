"""Write the rows of a table as JSON lines, as CSV or as Parquet, all with the same columns."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import IO, Any

from parenting.server.archive.columns import Column
from parenting.server.errors import SetupError
from parenting.server.spreadsheet import cell

AT_ONCE = 5000
"""Rows of a row group of Parquet."""
REMEDY = "pip install 'parenting[parquet]'"
Rows = Iterable[Mapping[str, Any]]
Write = Callable[[IO[bytes], Sequence[Column], Rows], None]


def write_jsonl(file: IO[bytes], columns: Sequence[Column], rows: Rows) -> None:
    """Write a JSON object in ASCII a line."""
    names = [column.name for column in columns]
    for row in rows:
        line = {name: row[name] for name in names}
        file.write(json.dumps(line, separators=(",", ":"), allow_nan=False).encode() + b"\n")


def write_csv(file: IO[bytes], columns: Sequence[Column], rows: Rows) -> None:
    """Write a head and a line for each row; text that a spreadsheet would take for a formula is quoted."""
    names = [column.name for column in columns]
    lines = csv.writer(_Encoded(file), lineterminator="\n")
    lines.writerow(names)
    for row in rows:
        lines.writerow([cell(row[name]) for name in names])


class _Encoded:
    """A file of bytes that takes text, a line at a time."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file

    def write(self, line: str) -> None:
        self._file.write(line.encode())


def parquet_installed() -> bool:
    """Return whether Parquet can be written here."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        return False
    return True


def write_parquet(file: IO[bytes], columns: Sequence[Column], rows: Rows) -> None:
    """Write Parquet with the types of the columns, whatever is missing.

    Raises:
        SetupError: pyarrow is not installed.
    """
    try:
        import pyarrow as arrow
        import pyarrow.parquet as parquet
    except ImportError:
        raise SetupError(f"Parquet needs pyarrow: {REMEDY}") from None
    types = {str: arrow.string(), int: arrow.int64(), float: arrow.float64(), bool: arrow.bool_()}
    schema = arrow.schema([(column.name, types[column.type]) for column in columns])
    batch = list[dict[str, Any]]()
    with parquet.ParquetWriter(file, schema, compression="zstd") as writer:
        for row in rows:
            batch.append({column.name: row[column.name] for column in columns})
            if len(batch) == AT_ONCE:
                writer.write_table(arrow.Table.from_pylist(batch, schema=schema))
                batch = []
        writer.write_table(arrow.Table.from_pylist(batch, schema=schema))
