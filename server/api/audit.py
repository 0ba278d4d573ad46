"""Routes of the audit log: page by page, and whole as CSV."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from fastapi import Query
from fastapi.responses import StreamingResponse
from pydantic import Field

from parenting.server.admission import admitted_router
from parenting.server.api.lists import Cursor, Limit, Part
from parenting.server.api.responses import read_responses, streams
from parenting.server.audit.entries import as_table, entries
from parenting.server.audit.table import AuditEntry, Kind
from parenting.server.damage import damage
from parenting.server.deps import Db
from parenting.server.schemas import DamagedSchema, Schema

router = admitted_router(tags=["operator"])


class AuditSchema(Schema):
    """An entry of the audit log."""

    id: int
    created: datetime
    kind: Kind
    what: str
    """The deed: the operator's verb, the part that was exported, the code of a refusal."""
    who: str
    """The actor: a session, a token, or a command line of the machine and its user."""
    client: str | None
    """The address that asked; null: a command on the machine."""
    run: str | None
    """The public id of the run to which it was done."""
    count: int
    """The number of refusals that this entry tells of; else 1."""


class AuditRows(Schema):
    """Entries of the audit log, the newest first."""

    rows: list[AuditSchema | DamagedSchema]
    next: int | None
    """The cursor of the next page; null: these are the last rows for now."""


class AuditPart(Part):
    """The requested part of the audit log."""

    before: Cursor | None = Field(
        None, description="Only entries with smaller ids; the `next` of the page before."
    )
    limit: Limit = Field(50, ge=1, le=200, description="At most this many rows.")
    kind: Kind | None = Field(None, description="Only entries of this kind.")


class AuditKind(Part):
    """The entries of the audit log that are exported."""

    kind: Kind | None = Field(None, description="Only entries of this kind.")


class TableResponse(StreamingResponse):
    """A table as CSV."""

    media_type = "text/csv"


@router.get("/audit", summary="Read the audit log", responses=read_responses())
def read_audit_log(db: Db, part: Annotated[AuditPart, Query()]) -> AuditRows:
    """Read who logged in, exported, deleted and operated, and what was refused, the newest first.

    Refusals are counted and written every half a minute. Send the `next` of a page as `before` to get the
    following page.
    """
    found = entries(db, part.before, part.limit, part.kind)
    return AuditRows(rows=[_schema(row) for row in found.rows], next=found.next)


@router.get(
    "/audit/export",
    summary="Export the audit log",
    response_class=TableResponse,
    responses=streams("text/csv", "The whole log, the oldest entry first."),
)
def export_audit_log(db: Db, part: Annotated[AuditKind, Query()]) -> TableResponse:
    """Export the whole audit log as CSV, or its entries of one kind, the oldest first."""
    named = {"Content-Disposition": 'attachment; filename="audit.csv"'}
    return TableResponse(as_table(db, part.kind), media_type="text/csv; charset=utf-8", headers=named)


def _schema(row: AuditEntry) -> AuditSchema | DamagedSchema:
    found = damage(row)
    if found is not None:
        return DamagedSchema(id=row.id, damaged=found)
    return AuditSchema.model_validate(row, from_attributes=True)
