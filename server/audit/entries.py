"""The entries of the audit log, for whoever reads them: as pages, and whole as CSV."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from sqlalchemy import select

from parenting.server.audit.table import AuditEntry, Kind
from parenting.server.damage import damage, sound
from parenting.server.db import Database
from parenting.server.export import iso_time
from parenting.server.reads.pagination import Page, cut
from parenting.server.spreadsheet import as_csv

COLUMNS = ("id", "created", "kind", "what", "who", "client", "run", "count")
BATCH = 500


def entries(
    db: Database, before: int | None = None, limit: int = 50, kind: Kind | None = None
) -> Page[AuditEntry]:
    """Return entries with smaller ids than `before`, the newest first, only of one kind if given."""
    rows = select(AuditEntry).order_by(AuditEntry.id.desc()).limit(limit + 1)
    if before is not None:
        rows = rows.where(AuditEntry.id < before)
    if kind is not None:
        rows = rows.where(AuditEntry.kind == str(kind))
    with db.read() as session:
        return cut(session.scalars(rows).all(), limit, lambda row: row.id)


def as_table(db: Database, kind: Kind | None = None) -> Iterator[str]:
    """Yield the whole log as CSV, or its entries of one kind, the oldest first, read in batches."""
    return as_csv(lambda: _rows(db, kind), COLUMNS)


def told(row: AuditEntry) -> dict[str, Any]:
    """Return an entry by its columns; of a damaged one, what can be read."""
    values = {name: sound(row, name) for name in COLUMNS} | {"created": iso_time(sound(row, "created"))}
    found = damage(row)
    return values | ({"damaged": found} if found else {})


def _rows(db: Database, kind: Kind | None) -> Iterator[dict[str, Any]]:
    last = 0
    while batch := _after(db, last, kind):
        yield from (told(row) for row in batch)
        last = batch[-1].id


def _after(db: Database, last: int, kind: Kind | None) -> Sequence[AuditEntry]:
    rows = select(AuditEntry).where(AuditEntry.id > last).order_by(AuditEntry.id).limit(BATCH)
    if kind is not None:
        rows = rows.where(AuditEntry.kind == str(kind))
    with db.read() as session:
        return session.scalars(rows).all()
