"""Replies that are not JSON: the live stream of a run, its answers as JSON lines, its policy as a file."""

from __future__ import annotations

from collections.abc import AsyncIterable
from typing import Annotated

from fastapi import Depends, Header, Query, Request, Response
from fastapi.responses import StreamingResponse
from fastapi.sse import EventSourceResponse, ServerSentEvent

from parenting.server.access.staying import Stay
from parenting.server.admission import admitted_router
from parenting.server.api.lists import ExportPart, FollowPart
from parenting.server.api.names import RunId
from parenting.server.api.responses import streams
from parenting.server.archive.zipped import zipped
from parenting.server.audit.recording import note_export
from parenting.server.deps import Db, SettingsOf
from parenting.server.exports import MEDIA, Format, exported, file_name
from parenting.server.policies import present_policy
from parenting.server.runs import get_run

router = admitted_router(tags=["runs"])

LINES = "application/x-ndjson"
EXPORTED = streams(LINES, "A line for each answer, tick or event; CSV has a head.", 404)
EXPORTED[200]["content"] |= {"text/csv": {}, "application/zip": {}}


class PolicyResponse(Response):
    """A file of safetensors."""

    media_type = "application/octet-stream"


class LinesResponse(StreamingResponse):
    """JSON lines."""

    media_type = LINES


def known(request: Request, run_id: RunId, db: Db) -> int:
    """Refuse an unknown run before the stream begins: afterwards it is too late for a 404."""
    get_run(db, run_id)
    request.app.state.streams.check_room()
    request.app.state.seats.check(request)
    return run_id


@router.get(
    "/runs/{run_id}/events",
    summary="Follow a run",
    response_class=EventSourceResponse,
    responses=streams("text/event-stream", "Server-sent events, until the client leaves.", 404, 429),
)
async def follow_run(
    request: Request,
    run_id: Annotated[int, Depends(known)],
    part: Annotated[FollowPart, Query()],
    last_event_id: Annotated[str | None, Header(description="As a browser sends it.")] = None,
) -> AsyncIterable[ServerSentEvent]:
    """Follow a run by server-sent events: the state at the beginning, then every change.

    `run` is the run as GET returns it, at most once in 250 ms. `question` is the most urgent open question
    (id and kind) or null, without delay. `leases` says without delay who holds which open question, by a name
    that tells nothing else, and comes again when a lease ends. `metrics` are rows of the ticks after `after`,
    if it is given.
    """
    after, seen = part.after, last_event_id or ""
    if after is not None and seen.isdigit() and len(seen) < 16:
        after = max(after, int(seen))
    with request.app.state.seats.taken(request):
        async for event in request.app.state.streams.subscribe(run_id, after, Stay(request)):
            yield event


@router.get(
    "/runs/{run_id}/export",
    summary="Export the answers, the metrics or the log",
    response_class=LinesResponse,
    responses=EXPORTED,
)
def export_run(
    run_id: RunId, db: Db, settings: SettingsOf, part: Annotated[ExportPart, Query()]
) -> StreamingResponse:
    """Export all answers up to now as JSON lines, oldest first; or the metrics or the log; or as CSV.

    A line of the answers holds the question, the choice, who answered and when, the tick at which the agent
    heard it, and the policy that asked. docs/api.md lists the fields. CSV has one head, of clips the actions
    alone, and an apostrophe before text that a spreadsheet would take for a formula. The zip holds the whole
    run, as `parenting export RUN --out FILE.zip` writes it.
    """
    if part.format == "zip":
        name = {"Content-Disposition": f'attachment; filename="run-{run_id}.zip"'}
        pieces = zipped(db, [run_id], settings.data)
        note_export(db, run_id, "the whole run as zip")
        return StreamingResponse(pieces, media_type="application/zip", headers=name)
    form = Format(part.format)
    file = f'attachment; filename="{file_name(run_id, part.of, form)}"'
    lines = exported(db, run_id, part.of, form)
    note_export(db, run_id, f"{part.of} as {form}")
    return StreamingResponse(lines, media_type=MEDIA[form], headers={"Content-Disposition": file})


@router.get(
    "/runs/{run_id}/policy",
    summary="Download the policy",
    response_class=PolicyResponse,
    responses=streams("application/octet-stream", "A file of safetensors with a model card.", 404),
)
def download_policy(run_id: RunId, db: Db) -> PolicyResponse:
    """Download the present policy as a file of safetensors, as the run's last checkpoint has it.

    Its metadata holds a model card: world, level, config, the size of X, hashes, the run, and how to load it
    (`parenting.load_policy`). A run without a checkpoint has none yet: 404.
    """
    found = present_policy(db, run_id)
    file = f'attachment; filename="{found.name}"'
    return PolicyResponse(found.blob, headers={"Content-Disposition": file})
