"""Routes of questions: list them, read one, lease the most urgent, answer it, release it."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

from fastapi import Query, Request, Response
from fastapi.responses import JSONResponse

from parenting.server.admission import admitted_router
from parenting.server.api.bodies import AnswerBody, LeaseBody
from parenting.server.api.lists import AskedPart, AskedRows
from parenting.server.api.names import QueryId, QueryName, RunId
from parenting.server.api.responses import read_responses, write_responses
from parenting.server.deps import Db, SettingsOf, notify_worker
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease, release
from parenting.server.queue.names import Names
from parenting.server.reads import pagination
from parenting.server.reads.schemas import asked_schema, asked_schemas, leased_schema
from parenting.server.runs import get_run
from parenting.server.schemas import AskedSchema, LeasedSchema, StoredSchema

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
def lease_question(run_id: RunId, body: LeaseBody, db: Db, settings: SettingsOf) -> Response:
    """Lease the most urgent open question (guidance first, then the oldest) for this client, for 60 s.

    The reply holds all that a parent needs to answer it. Leasing again renews the lease. The status is 204 if
    no question waits or if the run has reached its goal.
    """
    get_run(db, run_id)
    query = lease(db, run_id, body.client_id, settings.lease_seconds)
    if query is None:
        return Response(status_code=204)
    return JSONResponse(leased_schema(db, query).model_dump(mode="json"))


@router.get("/queries/{query_id}", summary="Look at a question", responses=read_responses(404))
def get_question(query_id: QueryId, db: Db) -> AskedSchema:
    """Read one question, with its answer if one stands. This leases nothing."""
    return asked_schema(db, pagination.asked(db, query_id))


@router.post(
    "/queries/{query_id}/answer", summary="Answer a question", responses=write_responses(404, 409, 410)
)
def answer_question(request: Request, query_id: QueryName, body: AnswerBody, db: Db) -> StoredSchema:
    """Store an answer, once.

    An answer that names a database, a run or a question which is not the one here gets 410 (`elsewhere`) and
    is not stored. Send the names that came with the question, so that no other server at this address takes
    the answer for a question of the same number.

    The same answer by the same client gets the same reply, so a client that lost the reply can send it again.
    Another choice, or another client's answer, gets 409 and is not stored. A late answer is stored if none
    stands.
    """
    names = Names(body.database, body.run, body.question)
    stored = answer(db, query_id, body.choice, body.client_id, body.parent, names)
    notify_worker(request)
    return StoredSchema(**asdict(stored))


@router.post(
    "/queries/{query_id}/release",
    summary="Let go of a question",
    status_code=204,
    responses=write_responses(404),
)
def release_question(query_id: QueryId, body: LeaseBody, db: Db) -> None:
    """Offer a leased question to others at once. Only its holder can; others change nothing."""
    release(db, query_id, body.client_id)
