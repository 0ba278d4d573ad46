"""The answers, questions and metrics of an export in a temporary database, so that memory stays bounded."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from typing import Any

from parenting.audit.files import Files
from parenting.audit.findings import Findings

SAID = (
    *("run", "number", "question", "kind", "choice", "standing", "supersedes", "superseded_by"),
    *("tick", "applied_tick", "in_x", "mu_left", "mu_right", "digest", "link", "erased"),
)
ASKED = ("run", "question", "kind", "tick", "status")
MEASURED = (
    *("run", "tick", "size", "guidance", "preference", "left", "right", "either", "neither", "skips"),
)
INDICES = (
    "CREATE INDEX of_question ON answer (question, applied_tick)",
    "CREATE INDEX after ON answer (run, supersedes) WHERE supersedes IS NOT NULL",
)
"""Without them a check looks through all answers for each answer."""
APOSTROPHE = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")  # noqa: RUF001 - wide ones, too


def load(files: Files, found: Findings) -> sqlite3.Connection:
    """Return the tables of an export; duplicates and differences between forms are found on the way."""
    store = begun()
    _fill(store, "answer", SAID, _answers(files, found), found)
    _fill(store, "question", ASKED, files.lines("questions.jsonl"), found)
    _fill(store, "metric", MEASURED, map(_numbers, files.cells("metrics.csv")), found)
    return store


def begun() -> sqlite3.Connection:
    """Return the tables without rows. SQLite keeps them in a file without a name, gone with this process."""
    store = sqlite3.connect("")
    store.execute(f"CREATE TABLE answer ({', '.join(SAID)}, PRIMARY KEY (run, number))")
    store.execute(f"CREATE TABLE question ({', '.join(ASKED)}, PRIMARY KEY (question))")
    store.execute(f"CREATE TABLE metric ({', '.join(MEASURED)}, PRIMARY KEY (run, tick))")
    for index in INDICES:
        store.execute(index)
    return store


def _fill(
    store: sqlite3.Connection, table: str, names: tuple[str, ...], rows: Iterator[Any], found: Findings
) -> None:
    into = f"INSERT INTO {table} VALUES ({', '.join('?' * len(names))})"
    for row in rows:
        try:
            store.execute(into, [row[name] for name in names])
        except sqlite3.IntegrityError:
            found(f"{table} {{0}} stands twice", row.get("number", row.get("question", row.get("tick"))))
        except (KeyError, sqlite3.Error):
            found(f"a row of {table} lacks a column or holds a value of another type")


def _answers(files: Files, found: Findings) -> Iterator[dict[str, Any]]:
    """Yield the answers of the JSON lines, each compared with its row of the CSV."""
    cells, number = files.cells("answers.csv"), 0
    for number, row in enumerate(files.lines("answers.jsonl"), start=1):
        told = next(cells, None)
        if told is None or told != {name: _cell(value) for name, value in row.items()}:
            found("row {0} of answers.csv is not row {0} of answers.jsonl", number)
        yield row
    if next(cells, None) is not None:
        found(f"answers.csv has more than the {number} rows of answers.jsonl")


def _cell(value: Any) -> str:
    if isinstance(value, str):
        return f"'{value}" if value.startswith(APOSTROPHE) else value
    return "" if value is None else json.dumps(value)


def _numbers(cells: dict[str, str]) -> dict[str, Any]:
    """Return the cells of the columns that are checked; others may hold text, such as `more`."""
    known = ((name, cells[name]) for name in MEASURED if name in cells)
    return {name: cell if name == "run" or not cell else float(cell) for name, cell in known}
