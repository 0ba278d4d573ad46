"""Forms of a parent who cannot tell: skip, look again, let either move do, or end the episode."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from functools import partial
from typing import Annotated

from fastapi import Query as QueryParameter
from fastapi import Request, Response

from parenting.server import runs
from parenting.server.access.guard import is_own_question, principal_of, require_own_question
from parenting.server.admission import admitted_router
from parenting.server.api.names import PublicId, RunId
from parenting.server.db import Database
from parenting.server.deps import Db, SettingsOf, notify_worker, store
from parenting.server.measures import BY_FORM
from parenting.server.operator_events import end_episode_that_stands_still
from parenting.server.pages.fields import ClientField, DatabaseField, QuestionField
from parenting.server.pages.parent import PATIENCE, address, wait_for
from parenting.server.pages.render import redirect
from parenting.server.queue import leases
from parenting.server.queue.answers import Said
from parenting.server.queue.names import Names
from parenting.server.queue.revisions import supersede
from parenting.server.queue.skips import skip_in
from parenting.server.reads.set_aside import set_aside
from parenting.server.streams import Streams
from parenting.server.tables import SKIP, Query

router = admitted_router(include_in_schema=False)

OTHERS_FIRST = 0.3
"""Seconds after a skip in which other parents may have the next question."""

After = Annotated[PublicId | None, QueryParameter()]


@router.post("/runs/{run_id}/parent/skip")
async def skip(
    request: Request,
    run_id: PublicId,
    db: Db,
    settings: SettingsOf,
    client_id: ClientField,
    database: DatabaseField,
    question: QuestionField,
) -> Response:
    """Skip a question, then go to the next one."""
    await request.app.state.admission.read(require_own_question, request, db, question)
    said, names = Said(SKIP, client_id, "human", measured=BY_FORM), Names(database, run_id, question)
    found = await store(request, partial(skip_in, db=db, query=question, said=said, names=names))
    notify_worker(request)
    await asyncio.sleep(OTHERS_FIRST)
    streams: Streams = request.app.state.streams
    run = await streams.admission.read(runs.get_run, db, found.run)
    wish = leases.wanted(db, run.id, client_id, settings.lease_seconds)
    return redirect(address(run, await wait_for(request, run.id, wish, PATIENCE)))


@router.get("/runs/{run_id}/parent/again")
def again(request: Request, run_id: RunId, db: Db, after: After = None) -> Response:
    """Go to a question that was skipped in this pause, to answer it: the first, or that after one."""
    run, skipped = runs.get_run(db, run_id), _set_aside(request, db, run_id)
    places = [query.public_id for query in skipped]
    following = places.index(after) + 1 if after in places else 0
    return redirect(address(run, skipped[following % len(skipped)] if skipped else None, change=True))


@router.post("/runs/{run_id}/parent/either")
def either(request: Request, run_id: RunId, db: Db, client_id: ClientField) -> Response:
    """Answer what was skipped last with *either*: the agent makes one of the two moves."""
    run, skipped = runs.get_run(db, run_id), _set_aside(request, db, run_id)
    if skipped:
        supersede(db, skipped[-1].public_id, "either", client_id, "human")
        notify_worker(request)
    return redirect(address(run, None))


@router.post("/runs/{run_id}/parent/end-episode")
def end_episode(request: Request, run_id: RunId, db: Db) -> Response:
    """End an episode in which the agent stands still, since its parent refused or skipped every move."""
    run = runs.get_run(db, run_id)
    end_episode_that_stands_still(db, run_id)
    notify_worker(request)
    return redirect(address(run, None))


def _set_aside(request: Request, db: Database, run_id: int) -> Sequence[Query]:
    """Return the skipped questions of a pause, as far as they are the caller's own."""
    found, who = set_aside(db, run_id), principal_of(request)
    if not who.bound:
        return found
    with db.read() as session:
        return [query for query in found if is_own_question(session, who, query.public_id)]
