"""One stream for all the parent's pages of a browser: what happens in their runs, and their next questions.

A browser opens six connections to a host, so its pages share one stream (`web/static/carried.js`). It leases
questions, so it is opened by a POST; the script reads it as it comes. A page has two questions at most, one
that it shows and one for afterwards; once one of them is answered, another one is sent without a request.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterable, Sequence
from contextlib import suppress
from functools import partial
from typing import Annotated, Any

from fastapi import Depends, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import Field

from parenting.server import runs
from parenting.server.access.guard import principal_of
from parenting.server.access.staying import Stay
from parenting.server.admission import admitted_router
from parenting.server.api.bodies import ClientId, Strict
from parenting.server.api.names import PublicId
from parenting.server.db import Database
from parenting.server.deps import Db, SettingsOf, store
from parenting.server.errors import NotAllowedError, NotFound, ServerError
from parenting.server.identity import database_id
from parenting.server.pages.question import repeated_view
from parenting.server.pages.render import render
from parenting.server.queue.leases import More
from parenting.server.reads.names import query_numbers, run_number
from parenting.server.streams import POLL_SECONDS, Streams
from parenting.server.subscriptions import either
from parenting.server.tables import Query, Run

router = admitted_router(include_in_schema=False)

Events = asyncio.Queue[ServerSentEvent | None]

AGAIN_SECONDS = 1.0
"""Seconds after which a question is looked for again, whether anything was seen to change or not: one that
the page gave up is offered to others first."""
PAGES = 20
"""Pages of one stream."""


class CarriedPage(Strict):
    """A run that a page shows, and what it has of it."""

    run: PublicId
    client_id: ClientId
    shown: list[PublicId] = Field(max_length=100)  # its questions, and those whose answers are on their way
    asks: bool  # somebody looks at it, so that questions are leased for it


class Carried(Strict):
    """The pages of one browser."""

    pages: list[CarriedPage] = Field(min_length=1, max_length=PAGES)


async def found_runs(request: Request, body: Carried, db: Db) -> list[Run | None]:
    """Return the runs of the pages, None for one that is not here; refuse one stream too many."""
    streams: Streams = request.app.state.streams
    who = principal_of(request)
    if not all(who.reaches_run(page.run) for page in body.pages):
        raise NotAllowedError
    streams.check_room()
    request.app.state.seats.check(request)
    return await streams.admission.read(partial(_runs, db, [page.run for page in body.pages]))


@router.post("/runs/parent/stream", response_class=EventSourceResponse)
async def carry(
    request: Request,
    body: Carried,
    db: Db,
    settings: SettingsOf,
    of: Annotated[list[Run | None], Depends(found_runs)],
) -> AsyncIterable[ServerSentEvent]:
    """Send what happens in several runs as events whose data are `[page, what]`.

    `run`, `question`, `leases` are those of a run's own stream; `asked` is the markup of a leased question,
    `lost` the status of a run that is not here.
    """
    streams: Streams = request.app.state.streams
    events: Events = asyncio.Queue(maxsize=100)
    stay, tasks = Stay(request), []
    for at, (page, run) in enumerate(zip(body.pages, of, strict=True)):
        if run is None:
            yield _event("lost", at, 404)
            continue
        tasks.append(asyncio.create_task(_follow(streams, run.id, at, events)))
        if page.asks:
            asks = _ask(request, db, run, page, settings.lease_seconds, at, events)
            tasks.append(asyncio.create_task(asks))
    try:
        with request.app.state.seats.taken(request):
            while (event := await _next(events, stay)) is not None:
                yield event
    finally:
        for task in tasks:
            task.cancel()


async def _next(events: Events, stay: Stay) -> ServerSentEvent | None:
    """Return what comes next; None at the server's end, and once the browser's session is over."""
    while not await stay.is_over():
        with suppress(TimeoutError):
            return await asyncio.wait_for(events.get(), stay.seconds)
    return None


async def _follow(streams: Streams, run_id: int, at: int, events: Events) -> None:
    """Pass on what happens in a run; the server's end ends the stream."""
    async for event in streams.subscribe(run_id, None):
        await events.put(ServerSentEvent(event=event.event, raw_data=f"[{at}, {event.raw_data}]"))
    await events.put(None)


async def _ask(
    request: Request,
    db: Database,
    run: Run,
    page: CarriedPage,
    seconds: float,
    at: int,
    events: Events,
) -> None:
    """Lease the next question whenever the page has room for one, and pass it on.

    A look that follows a change and finds nothing is repeated once after `POLL_SECONDS`, since a question
    that the page gave up is offered to others first.
    """
    streams: Streams = request.app.state.streams
    has = set(await streams.admission.read(query_numbers, db, page.shown))
    wish, pause = More(db, run.id, page.client_id, has, seconds), POLL_SECONDS
    with streams.joined(run.id) as subscription:
        while not streams.closed:
            offered, query = subscription.offered, None
            with suppress(ServerError):  # busy: the next look will tell
                query = await store(request, wish.hold, durable=False, worth=wish.is_offered)
            if query is None:
                await either(offered, pause)
                pause = POLL_SECONDS if offered.is_set() else AGAIN_SECONDS
                continue
            has.add(query.id)
            await events.put(_event("asked", at, await streams.admission.read(_markup, db, run, query, page)))


def _markup(db: Database, run: Run, query: Query, page: CarriedPage) -> str:
    shown = repeated_view(db, query, run)
    return render("_question.html", shown=shown, client=page.client_id, database=database_id(db))


def _event(kind: str | None, at: int, data: Any) -> ServerSentEvent:
    return ServerSentEvent(event=kind, raw_data=json.dumps([at, data]))


def _runs(db: Database, names: Sequence[str]) -> list[Run | None]:
    found: list[Run | None] = []
    for name in names:
        try:
            found.append(runs.get_run(db, run_number(db, name)))
        except NotFound:
            found.append(None)
    return found
