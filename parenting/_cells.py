"""The rows of a CSV file by their columns; one with more cells than columns, or fewer, is refused."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator


def whole_rows(lines: Iterable[str], name: str = "") -> Iterator[dict[str, str]]:
    """Yield the rows of a CSV file; blank lines are none.

    Args:
        lines: The lines of the file.
        name: Its name, for errors.

    Raises:
        ValueError: A row has not a cell for each column, or two columns have one name.
    """
    reader, where = csv.reader(lines), f"{name}: " * bool(name)
    names = next(reader, [])
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise ValueError(f"{where}line 1: the column {twice!r} stands there twice. Remove or rename one")
    for cells in filter(None, reader):
        if len(cells) != len(names):
            said = f"{where}line {reader.line_num}: its cells are {len(cells)}, the columns {len(names)}"
            raise ValueError(f"{said}. Remove or add cells, or quote a cell that holds commas")
        yield dict(zip(names, cells, strict=True))
