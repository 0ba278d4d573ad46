"""The rows of a table that is written in several forms: read from the database once, then kept on the disk.

Rows are lists of JSON in a compressed file without a name: they cost no memory, and nothing is left of them
where the process is killed.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from gzip import GzipFile
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

LEVEL = 1
"""Of gzip: the fastest."""


class Spool:
    """Rows that pass once, and come again as often as they are asked for."""

    def __init__(self, folder: Path, names: Sequence[str]) -> None:
        """Begin a spool.

        Args:
            folder: The folder in which the file without a name lies.
            names: The columns that are kept; their values are text, numbers, true or false, or missing.
        """
        self._names = names
        self._file: IO[bytes] = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 - closed at the exit

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the rows."""
        self._file.close()

    def kept(self, rows: Iterator[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
        """Yield rows, and keep them."""
        with GzipFile(fileobj=self._file, mode="wb", compresslevel=LEVEL, mtime=0) as kept:
            for row in rows:
                line = json.dumps([row[name] for name in self._names], separators=(",", ":"))
                kept.write(line.encode() + b"\n")
                yield row

    def rows(self) -> Iterator[Mapping[str, Any]]:
        """Yield the rows that were kept."""
        self._file.seek(0)
        with GzipFile(fileobj=self._file, mode="rb") as kept:
            for line in kept:
                yield dict(zip(self._names, json.loads(line), strict=True))
