"""The disk space of a run: the bytes of texts, JSON and checkpoints in every table that has rows of runs.

The store adds some overhead for each row and index. A row of the table `run` itself is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import add
from typing import Any

from sqlalchemy import Select, func, literal, select, union_all
from sqlalchemy import Table as SqlTable
from sqlalchemy.orm import Session

from parenting.server.columns import Blob, Json, Words
from parenting.server.db import Database
from parenting.server.measures import Measures
from parenting.server.tables import Table


def tables_of_runs() -> list[SqlTable]:
    """Return the tables with rows of a run, those that point to others first: so they may be deleted."""
    return [table for table in reversed(Table.metadata.sorted_tables) if "run_id" in table.c]


def sizes(db: Database, run_ids: Sequence[int]) -> dict[int, int]:
    """Return the bytes of each of these runs."""
    with db.read() as session:
        return sizes_in(session, run_ids)


def sizes_in(session: Session, run_ids: Sequence[int]) -> dict[int, int]:
    """Return the bytes of each of these runs, in a transaction that is already open."""
    length = func.octet_length if session.get_bind().dialect.name == "sqlite" else func.pg_column_size
    parts = union_all(*(_bytes(table, length, run_ids) for table in tables_of_runs())).subquery()
    rows = select(parts.c.run_id, func.sum(parts.c.bytes)).group_by(parts.c.run_id)
    found = {run_id: int(total or 0) for run_id, total in session.execute(rows)}
    return {run_id: found.get(run_id, 0) for run_id in run_ids}


def _bytes(table: SqlTable, length: Any, run_ids: Sequence[int]) -> Select[Any]:
    """Count the bytes of a table's long columns, by run. No value is read: each row tells its lengths."""
    long = [column for column in table.c if isinstance(column.type, Words | Json | Blob | Measures)]
    total = func.sum(reduce(add, (func.coalesce(length(column), 0) for column in long), literal(0)))
    of_runs = select(table.c.run_id, total.label("bytes")).where(table.c.run_id.in_(run_ids))
    return of_runs.group_by(table.c.run_id)


def size_text(bytes_: int) -> str:
    """Return an amount of bytes for people."""
    size, unit = float(bytes_), "bytes"
    for larger in ("kB", "MB", "GB", "TB"):
        if size < 1000:
            break
        size, unit = size / 1000, larger
    return f"{size:.0f} {unit}" if unit == "bytes" or size >= 10 else f"{size:.1f} {unit}"
