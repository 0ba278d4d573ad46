"""Exports of a run: its answers, its metrics or its log, as JSON lines or as CSV."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from enum import StrEnum
from functools import partial
from typing import Any

from sqlalchemy import select

from parenting.server.damage import damage, sound
from parenting.server.db import Database
from parenting.server.export import iso_time, rows
from parenting.server.reads.metrics import list_metrics
from parenting.server.runs import stored_run
from parenting.server.spreadsheet import as_csv
from parenting.server.tables import OperatorEvent

BATCH = 1000


class Part(StrEnum):
    """The part of a run that is exported."""

    ANSWERS = "answers"
    METRICS = "metrics"
    EVENTS = "events"


class Format(StrEnum):
    """The format of an export."""

    JSONL = "jsonl"
    CSV = "csv"


MEDIA = {Format.JSONL: "application/x-ndjson", Format.CSV: "text/csv; charset=utf-8"}
FIRST = {
    Part.ANSWERS: ("run", "number", "query", "kind", "choice", "received"),
    Part.METRICS: ("run", "tick"),
    Part.EVENTS: ("run", "id", "kind", "created", "applied_tick"),
}
"""The columns that stand first in CSV."""


def exported(
    db: Database, run_id: int, part: Part = Part.ANSWERS, form: Format = Format.JSONL
) -> Iterator[str]:
    """Return lines of a part of a run, up to now, read in batches.

    Raises:
        NotFound: the run does not exist; raised here, not at the first line.
    """
    stored_run(db, run_id)
    begin = partial(ROWS[part], db, run_id)
    if form is Format.CSV:
        return as_csv(begin, FIRST[part])
    return (json.dumps(row, separators=(",", ":")) + "\n" for row in begin())


def file_name(run_id: int, part: Part = Part.ANSWERS, form: Format = Format.JSONL) -> str:
    """Return the name of an export's file."""
    return f"run-{run_id}.{form}" if part is Part.ANSWERS else f"run-{run_id}-{part}.{form}"


def _metrics(db: Database, run_id: int) -> Iterator[dict[str, Any]]:
    last = -1
    while batch := list_metrics(db, run_id, last, BATCH):
        for row in batch:
            found = damage(row)
            known = {"damaged": found} if found else row.values
            yield {"run": run_id, "tick": sound(row, "tick"), **known}
        ticks = [tick for row in batch if (tick := sound(row, "tick")) is not None]
        if len(batch) < BATCH or not ticks:
            return
        last = ticks[-1]


def _events(db: Database, run_id: int) -> Iterator[dict[str, Any]]:
    last = -1
    of_run = select(OperatorEvent).where(OperatorEvent.run_id == run_id).order_by(OperatorEvent.id)
    while True:
        with db.read() as session:
            batch = session.scalars(of_run.where(OperatorEvent.id > last).limit(BATCH)).all()
        for row in batch:
            found = damage(row)
            names = ("id", "kind", "applied_tick")
            told = {name: sound(row, name) for name in names} | {"created": iso_time(sound(row, "created"))}
            yield {"run": run_id, **told, **({"damaged": found} if found else {"payload": row.payload})}
        if len(batch) < BATCH:
            return
        last = batch[-1].id


ROWS: dict[Part, Callable[[Database, int], Iterator[dict[str, Any]]]] = {
    Part.ANSWERS: rows,
    Part.METRICS: _metrics,
    Part.EVENTS: _events,
}
