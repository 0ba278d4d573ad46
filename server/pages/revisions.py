"""Forms of second thoughts: take the last answer back, or change one; both work without JavaScript."""

from __future__ import annotations

from functools import partial

from fastapi import Request, Response

from parenting.server.access.guard import require_own_question
from parenting.server.admission import admitted_router
from parenting.server.api.names import PublicId
from parenting.server.deps import Db, SettingsOf, notify_worker, store
from parenting.server.measures import BY_FORM
from parenting.server.pages.fields import (
    ChoiceField,
    ClientField,
    DatabaseField,
    MeasuredField,
    QuestionField,
    ReplaysField,
)
from parenting.server.pages.render import redirect
from parenting.server.queue.answers import Said
from parenting.server.queue.names import Names
from parenting.server.queue.revisions import supersede_in, withdraw_in

router = admitted_router(include_in_schema=False)


@router.post("/runs/{run_id}/parent/withdraw")
async def withdraw(
    request: Request,
    run_id: PublicId,
    db: Db,
    settings: SettingsOf,
    client_id: ClientField,
    database: DatabaseField,
    question: QuestionField,
) -> Response:
    """Take an answer back and show its question again; one that was heard is shown to be changed."""
    names = Names(database, run_id, question)
    verb = partial(withdraw_in, db=db, query=question, client_id=client_id, names=names)
    found = await store(request, partial(verb, seconds=settings.lease_seconds))
    notify_worker(request)
    change = "&change=true" if found.outcome == "heard" else ""
    return redirect(f"/runs/{found.run_public_id}/parent?query={found.query_public_id}{change}")


@router.post("/runs/{run_id}/parent/change")
async def change(
    request: Request,
    run_id: PublicId,
    db: Db,
    choice: ChoiceField,
    client_id: ClientField,
    database: DatabaseField,
    question: QuestionField,
    replays: ReplaysField = None,
    measured: MeasuredField = None,
) -> Response:
    """Put another answer in the place of one's own, then go on."""
    await request.app.state.admission.read(require_own_question, request, db, question)
    names, seen = Names(database, run_id, question), BY_FORM if measured is None else measured.model_dump()
    said = Said(choice, client_id, "human", replays, seen)
    found = await store(request, partial(supersede_in, db=db, query=question, said=said, names=names))
    notify_worker(request)
    return redirect(f"/runs/{found.run_public_id}/parent")
