"""Routes of questions: list them, read one, lease the most urgent, answer it, release it."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import Query, Request, Response
from sqlalchemy.orm import Session

from parenting.server.access.staying import Stay
from parenting.server.admission import admitted_router
from parenting.server.api.bodies import AnswerBody, LeaseBody, NextBody
from parenting.server.api.lists import AskedPart, AskedRows
from parenting.server.api.names import QueryId, QueryName, RunId, RunName
from parenting.server.api.responses import read_responses, write_responses
from parenting.server.db import Database
from parenting.server.deps import Db, SettingsOf, notify_worker, store
from parenting.server.queue.answers import Said, Stored, answer_in
from parenting.server.queue.leases import is_offered, lease_in, release_in
from parenting.server.queue.names import Names
from parenting.server.reads import pagination
from parenting.server.reads.names import is_there, require_run, run_number
from parenting.server.reads.schemas import SHOWN_RUNS, asked_schema, asked_schemas, leased_schema
from parenting.server.reads.why import why
from parenting.server.receipts import StoredSchema
from parenting.server.schemas import AskedSchema, LeasedSchema
from parenting.server.streams import Streams
from parenting.server.why_schemas import WhySchema

router = admitted_router(tags=["questions"])


@router.get("/runs/{run_id}/queries", summary="List a run's questions", responses=read_responses(404))
def list_questions(run_id: RunId, db: Db, part: Annotated[AskedPart, Query()]) -> AskedRows:
    """List the questions of a run, oldest first, with the answers that stand.

    Send the `next` of a page as `after` to get the following page.
    """
    page = pagination.asked_after(db, run_id, part.after, part.limit, part.status)
    return AskedRows(rows=asked_schemas(db, page.rows), next=page.next)


@router.post(
    "/runs/{run_id}/queries/lease",
    summary="Lease the next question",
    response_model=LeasedSchema,
    responses={204: {"description": "No question waits."}, **write_responses(404)},
)
async def lease_question(
    request: Request, run_id: RunName, body: NextBody, db: Db, settings: SettingsOf
) -> Response:
    """Lease the most urgent open question (guidance first, then the oldest) for this client, for 60 s.

    The reply holds all that a parent needs to answer it. Leasing again renews the lease. The status is 204 if
    no question waits or if the run has reached its goal. With `wait` the request lies at the server for so
    many seconds until one is free; where too many lie there already, the status is 204 at once.
    """
    streams: Streams = request.app.state.streams
    number = await _number(streams, db, run_id)
    asks = (db, number, body.client_id)
    sure = partial(store, request, partial(_lease, *asks, settings.lease_seconds), durable=False)
    look, leased = partial(sure, worth=partial(_is_worth_it, *asks)), None
    if body.wait:
        leased = await streams.wait_for(number, look, body.wait, Stay(request).is_left, sure)
    else:
        leased = await look()
    if leased is None:
        return Response(status_code=204)
    return Response(leased.model_dump_json(), media_type="application/json")


async def _number(streams: Streams, db: Database, name: int | str) -> int:
    """Return the number of a run. That of a public id never changes, and no other run ever gets it."""
    if isinstance(name, int):
        return name
    known = streams.numbers.get(name)
    if known is None:
        known = await streams.admission.read(run_number, db, name)
        if len(streams.numbers) >= SHOWN_RUNS:
            streams.numbers.clear()
        streams.numbers[name] = known
    return known


def _lease(
    db: Database, run_id: int, client_id: str, seconds: float, session: Session
) -> LeasedSchema | None:
    query = lease_in(session, db, run_id, client_id, seconds)
    if query is None:
        require_run(session, run_id)
        return None
    return leased_schema(session, query)


def _is_worth_it(db: Database, run_id: int, client_id: str, session: Session) -> bool:
    """Return whether a question can be leased, or the run is not there, which the verb says."""
    return is_offered(session, db, run_id, client_id) or not is_there(session, run_id)


@router.get("/queries/{query_id}", summary="Look at a question", responses=read_responses(404))
def get_question(query_id: QueryId, db: Db) -> AskedSchema:
    """Read one question, with its answer if one stands. This leases nothing."""
    return asked_schema(db, pagination.asked(db, query_id))


@router.get("/queries/{query_id}/why", summary="Read why a question was asked", responses=read_responses(404))
def get_reason(query_id: QueryId, db: Db) -> WhySchema:
    """Read the reason for a question, and what its answers changed.

    The reason: for guidance the familiarity of the local state, p_guid ** f and the draw that was below it;
    for a preference the two recordings and when they were made. The effects: the policy in the asked state,
    before an answer and 1, 10 and 100 ticks after. What older versions did not keep is null.
    """
    return why(db, query_id)


@router.post(
    "/queries/{query_id}/answer",
    summary="Answer a question",
    response_model=StoredSchema,
    responses=write_responses(404, 409, 410),
)
async def answer_question(request: Request, query_id: QueryName, body: AnswerBody, db: Db) -> Response:
    """Store an answer, once.

    An answer that names a database, a run or a question which is not the one here gets 410 (`elsewhere`) and
    is not stored. Send the names that came with the question, so that no other server at this address takes
    the answer for a question of the same number.

    The same answer by the same client gets the same reply, so a client that lost the reply can send it again.
    Another choice, or another client's answer, gets 409 and is not stored. A late answer is stored if none
    stands.
    """
    names = Names(body.database, body.run, body.question)
    said = Said(body.choice, body.client_id, body.parent, body.replays, body.measures)
    stored = await store(request, partial(_answer, db, query_id, said, names))
    notify_worker(request)
    return Response(StoredSchema(**vars(stored)).model_dump_json(), media_type="application/json")


def _answer(db: Database, query: int | str, said: Said, names: Names, session: Session) -> Stored:
    return answer_in(session, db, query, said, names)


@router.post(
    "/queries/{query_id}/release",
    summary="Let go of a question",
    status_code=204,
    responses=write_responses(404),
)
async def release_question(request: Request, query_id: QueryId, body: LeaseBody) -> None:
    """Offer a leased question to others at once. Only its holder can; others change nothing."""
    await store(request, partial(release_in, query_id=query_id, client_id=body.client_id))
