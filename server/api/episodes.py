"""The route of a life's episodes. One of them is shown again by a job of kind `episode`."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import Query
from pydantic import Field

from parenting.server import moves, runs
from parenting.server.admission import admitted_router
from parenting.server.api.lists import Cursor, Limit, Part, Rows
from parenting.server.api.names import RunId
from parenting.server.api.responses import read_responses
from parenting.server.deps import Db
from parenting.server.schemas import Schema

router = admitted_router(tags=["runs"])


class EpisodeSchema(Schema):
    """An episode of a life."""

    number: int
    """From 1, among those whose beginning is known."""
    first: int
    """The tick of its beginning."""
    last: int
    """Its last tick, or the last that is known of it."""
    steps: int
    pauses: int
    """Ticks in which the agent waited for guidance."""
    unsafe: int
    """Unsafe steps."""
    end: Literal["goal", "harm", "cut"] | None
    """The way it ended; cut: by the time limit or the operator; null: it goes on."""
    whole: bool
    """Every tick of it is known, so that it can be shown again."""


class EpisodeRows(Rows[EpisodeSchema]):
    """Episodes, newest first."""


class EpisodePart(Part):
    """The requested part of a life's episodes."""

    before: Cursor | None = Field(
        None, description="Only episodes with smaller numbers; the `next` of the page before."
    )
    limit: Limit = Field(50, ge=1, le=200, description="At most this many rows.")


@router.get("/runs/{run_id}/episodes", summary="List the episodes", responses=read_responses(404))
def list_episodes(run_id: RunId, db: Db, part: Annotated[EpisodePart, Query()]) -> EpisodeRows:
    """List the episodes of the agent's life, newest first, as far as its moves are stored.

    Send the `next` of a page as `before` to get the following page. Ask for a job of kind `episode` with a
    tick of one to see it again.
    """
    run = runs.get_run(db, run_id)
    found = moves.episodes(moves.read_moves(db, run.id))
    rows = found if part.before is None else found[: part.before - 1]
    shown = rows[-part.limit :][::-1]
    more = shown[-1].number if shown and shown[-1].number > 1 else None
    return EpisodeRows(rows=[EpisodeSchema(**vars(one)) for one in shown], next=more)
