"""Rows as CSV, for spreadsheets: one head for all rows, nested values in columns of their own, no formulas.

A cell that begins like a formula, in text that people may have written, gets an apostrophe before it: else a
spreadsheet would calculate it when the file is opened.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from io import StringIO
from itertools import islice
from typing import Any

FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")  # noqa: RUF001 - spreadsheets take wide ones, too
"""The beginnings of a formula."""
SIDES = ("left", "right")


def as_csv(rows: Callable[[], Iterable[Mapping[str, Any]]], first: Sequence[str] = ()) -> Iterator[str]:
    """Yield CSV, line by line.

    The rows are read twice, in as little memory as one needs: once for the names of all columns.

    Args:
        rows: Begins the rows again. What is added between is left out.
        first: Columns that stand first, also where there are no rows.
    """
    columns, number = dict.fromkeys(first), 0
    for row in rows():
        columns |= dict.fromkeys(flat(row))
        number += 1
    yield _line(columns)
    for row in islice(rows(), number):
        found = flat(row)
        yield _line(cell(found.get(column)) for column in columns)


def flat(row: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Return a row without nesting: `policy.stage` is `policy_stage`, of a clip the actions alone stand."""
    found: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, Mapping) and "frames" in value:
            found[f"{before}{name}_actions"] = " ".join(value["actions"])
        elif isinstance(value, Mapping):
            found |= flat(value, f"{before}{name}_")
        elif value is None and name in SIDES:
            found[f"{before}{name}_actions"] = None  # a damaged clip
        else:
            found[before + name] = value
    return found


def cell(value: Any) -> str:
    """Return a value as a cell holds it."""
    if value is None:
        return ""
    if isinstance(value, str):
        return f"'{value}" if value.startswith(FORMULA) else value
    return json.dumps(value, separators=(",", ":"))


def _line(cells: Iterable[str]) -> str:
    line = StringIO()
    csv.writer(line).writerow(cells)
    return line.getvalue()
