"""Routes on questions: lease the most urgent, look at one, answer it."""

from __future__ import annotations

from dataclasses import asdict

from fastapi import APIRouter, Request, Response
from fastapi.responses import JSONResponse

from server.api.words import AnswerBody, LeaseBody, QueryId, RunId, errors
from server.deps import Db, SettingsOf, ring
from server.queue import answer, get_query, lease
from server.runs import get_run
from server.shapes import LeasedShape, QueryShape, StoredShape, shape_leased, shape_query

router = APIRouter(tags=["questions"])


@router.post(
    "/runs/{run_id}/queries/lease",
    response_model=LeasedShape,
    responses={204: {"description": "No question waits."}, **errors(403, 404)},
)
def lease_next(run_id: RunId, body: LeaseBody, db: Db, settings: SettingsOf) -> Response:
    """The most urgent open question, guidance first, held for this client; 204 if there is none.

    Leasing again renews.
    """
    get_run(db, run_id)
    query = lease(db, run_id, body.client_id, settings.lease_seconds)
    if query is None:
        return Response(status_code=204)
    return JSONResponse(shape_leased(db, query).model_dump(mode="json"))


@router.get("/queries/{query_id}", responses=errors(404))
def query(query_id: QueryId, db: Db) -> QueryShape:
    """One question as it is now."""
    return shape_query(get_query(db, query_id))


@router.post("/queries/{query_id}/answer", responses=errors(403, 404, 409))
def answer_query(request: Request, query_id: QueryId, body: AnswerBody, db: Db) -> StoredShape:
    """Store an answer. The same again gets the same reply; another one, or somebody else's, gets 409."""
    stored = answer(db, query_id, body.choice, body.client_id, parent="human")
    ring(request)
    return StoredShape(**asdict(stored))
