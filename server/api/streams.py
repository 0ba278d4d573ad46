"""The live stream of a run."""

from __future__ import annotations

from collections.abc import AsyncIterable
from typing import Annotated

from fastapi import APIRouter, Depends, Header, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent

from server.api.words import After, RunId, errors
from server.deps import Db
from server.runs import get_run

router = APIRouter(tags=["streams"])


def known(request: Request, run_id: RunId, db: Db) -> int:
    """Refuse before the stream begins: afterwards it is too late for a 404."""
    get_run(db, run_id)
    request.app.state.streams.check_room()
    return run_id


@router.get("/runs/{run_id}/events", response_class=EventSourceResponse, responses=errors(404))
async def events(
    request: Request,
    run_id: Annotated[int, Depends(known)],
    after: After | None = None,
    last_event_id: Annotated[str | None, Header()] = None,
) -> AsyncIterable[ServerSentEvent]:
    """`run` as it changes, `question` when another waits or none, `metrics` if `after` is given."""
    if (
        after is not None
        and last_event_id is not None
        and last_event_id.isdigit()
        and len(last_event_id) < 16
    ):
        after = max(after, int(last_event_id))
    async for event in request.app.state.streams.follow(run_id, after):
        yield event
