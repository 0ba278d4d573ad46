"""Routes of presence: renew the leases of a page, or leave them."""

from __future__ import annotations

from functools import partial

from fastapi import Request
from sqlalchemy.orm import Session

from parenting.server.admission import admitted_router
from parenting.server.api.bodies import LeaseBody, RenewBody
from parenting.server.api.names import RunName
from parenting.server.api.responses import write_responses
from parenting.server.db import Database
from parenting.server.deps import Db, SettingsOf, store
from parenting.server.queue.presence import Renewed, leave_in, renew_in
from parenting.server.reads.names import require_run, run_number_in
from parenting.server.schemas import RenewedSchema

router = admitted_router(tags=["questions"])


@router.post("/runs/{run_id}/queries/renew", summary="Renew leases", responses=write_responses(404))
async def renew_leases(
    request: Request, run_id: RunName, body: RenewBody, db: Db, settings: SettingsOf
) -> RenewedSchema:
    """Hold the questions of a page for 60 s more, unless others hold them, and say who has each.

    A lease that is renewed ends 120 s after the person's last sign of life (`idle` seconds ago) at the
    latest. A question that nobody else wants stays answerable after that.
    """
    seconds = min(settings.lease_seconds, settings.attention_seconds - body.idle)
    found = await store(request, partial(_renew, db, run_id, body, seconds), durable=False)
    return RenewedSchema(**vars(found))


@router.post(
    "/runs/{run_id}/queries/leave",
    summary="Leave a run's questions",
    status_code=204,
    responses=write_responses(404),
)
async def leave_questions(request: Request, run_id: RunName, body: LeaseBody, db: Db) -> None:
    """Let all leases of this client in a run end within 5 s, unless it leases or renews them before."""
    await store(request, partial(_leave, db, run_id, body.client_id), durable=False)


def _renew(db: Database, name: int | str, body: RenewBody, seconds: float, session: Session) -> Renewed:
    run_id = run_number_in(session, name)
    require_run(session, run_id)
    return renew_in(session, db, run_id, body.client_id, body.questions, seconds)


def _leave(db: Database, name: int | str, client_id: str, session: Session) -> None:
    run_id = run_number_in(session, name)
    require_run(session, run_id)
    leave_in(session, db, run_id, client_id)
