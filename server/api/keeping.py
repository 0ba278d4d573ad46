"""Routes that keep runs in order: describe, archive and delete one, and see what is left of deleted ones."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any

from fastapi import Query, Request
from pydantic import Field

from parenting.server import deletion, keeping
from parenting.server.admission import admitted_router
from parenting.server.api.bodies import Strict
from parenting.server.api.lists import Cursor, Limit, Part
from parenting.server.api.names import PublicId, RunId
from parenting.server.api.responses import read_responses, write_responses
from parenting.server.damage import damage
from parenting.server.deps import Db, notify_worker
from parenting.server.errors import Conflict
from parenting.server.keeping import Description, Tag
from parenting.server.new_run import PersonsName
from parenting.server.reads.schemas import run_schema
from parenting.server.schemas import DamagedSchema, RunSchema, Schema
from parenting.server.tables import Tombstone

router = admitted_router(tags=["runs"])

DELETE_SECONDS = 1.0
"""Seconds for which a request deletes; a worker goes on with what is left of a large run."""


class DescribeBody(Strict):
    """The words that are kept with a run; what is left out stays as it is."""

    name: PersonsName | None = Field(None, description="null: none; the list shows its world and number.")
    description: Description | None = Field(None, description="At most 2000 characters; null: none.")
    tags: list[Tag] = Field(default_factory=list, max_length=20, description="All of its tags.")


class ArchiveBody(Strict):
    """The decision to leave a run out of the list."""

    archived: bool


class DeleteBody(Strict):
    """The confirmation that a run is to be deleted."""

    confirm: PublicId = Field(description="The run's `public_id`: no mistyped number deletes another run.")


class HoldsSchema(Schema):
    """The holdings of a run, which its deletion takes away."""

    run: int
    public_id: str
    answers: int
    questions: int
    checkpoints: int
    metrics: int
    events: int
    """The operator's events and the notes of the log."""
    bytes: int
    """The disk space of its texts, clips, metrics and checkpoints, without the store's own overhead."""


class TombstoneSchema(Schema):
    """The rest of a deleted run. Nothing in it was written by people."""

    run: int
    """Its number, which is never given again."""
    public_id: str
    created: datetime
    deleted: datetime
    """When its deletion was confirmed."""
    gone: datetime | None
    """When the last of its rows was deleted; null: there are some left, and a worker goes on."""
    held: dict[str, Any]
    """World, preset, seed, parent, status and tick at its end; the number of its answers, questions,
    checkpoints, metrics and events; its bytes; and the last link of its answers' chain of hashes, which tells
    a complete export of it from another one.
    """


class TombstoneRows(Schema):
    """Deleted runs, the largest number first."""

    rows: list[TombstoneSchema | DamagedSchema]
    next: int | None
    """The cursor of the next page; null: these are the last rows for now."""


class DeletedPart(Part):
    """The requested part of the deleted runs."""

    before: Cursor | None = Field(
        None, description="Only runs with smaller numbers; the `next` of the page before."
    )
    limit: Limit = Field(50, ge=1, le=200, description="At most this many rows.")


@router.post(
    "/runs/{run_id}/describe", summary="Name, describe and tag a run", responses=write_responses(404)
)
def describe_run(run_id: RunId, body: DescribeBody, db: Db) -> RunSchema:
    """Change the name, the description or the tags of a run, over or not. The agent learns the same."""
    keeping.describe(db, run_id, body.model_dump(include=body.model_fields_set))
    return run_schema(db, run_id)


@router.post("/runs/{run_id}/archive", summary="Archive a run", responses=write_responses(404))
def archive_run(run_id: RunId, body: ArchiveBody, db: Db) -> RunSchema:
    """Leave a run out of the list on the first page, or take it in again. Nothing of it is lost."""
    keeping.archive(db, run_id, body.archived)
    return run_schema(db, run_id)


@router.get("/runs/{run_id}/holds", summary="See what a run holds", responses=read_responses(404))
def see_holds(run_id: RunId, db: Db) -> HoldsSchema:
    """Count what a run holds: answers, questions, checkpoints, metrics, events, and the bytes of them all."""
    held = deletion.holds(db, run_id)
    return HoldsSchema(run=run_id, public_id=deletion.name_of(db, run_id), **held._asdict())


@router.post("/runs/{run_id}/delete", summary="Delete a run", responses=write_responses(404, 409))
def delete_run(request: Request, run_id: RunId, body: DeleteBody, db: Db) -> TombstoneSchema:
    """Delete a run with everything that it holds, for good. `GET /runs/{run_id}/holds` says what that is.

    From the reply on the run is not there for anybody: its worker leaves it, and an answer to one of its
    questions is refused. Rows of a large run may go after the reply, in pieces that hold up nobody (`gone`).
    What is left is this tombstone. Sent again meanwhile, it deletes on. Backups keep the run.
    """
    if deletion.name_of(db, run_id) != body.confirm:
        raise Conflict("This is not the public_id of the run; nothing was deleted.")
    stone = deletion.delete_run(db, run_id, DELETE_SECONDS)
    notify_worker(request)
    return _stone(stone)


@router.get("/tombstones", summary="List the deleted runs", responses=read_responses())
def list_tombstones(db: Db, part: Annotated[DeletedPart, Query()]) -> TombstoneRows:
    """List what is left of deleted runs, the largest number first.

    Send the `next` of a page as `before` to get the following page.
    """
    found = deletion.tombstones(db, part.before, part.limit + 1)
    rows = [
        DamagedSchema(id=row.id, damaged=fault) if (fault := damage(row)) else _stone(row)
        for row in found[: part.limit]
    ]
    return TombstoneRows(rows=rows, next=found[part.limit - 1].id if len(found) > part.limit else None)


def _stone(row: Tombstone) -> TombstoneSchema:
    names = ("public_id", "created", "deleted", "gone", "held")
    return TombstoneSchema(run=row.id, **{name: getattr(row, name) for name in names})
