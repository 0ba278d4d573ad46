"""Routes of second thoughts: take an answer of one's own back, change it, or skip a question."""

from __future__ import annotations

from functools import partial

from fastapi import Request

from parenting.server.admission import admitted_router
from parenting.server.api.bodies import AnswerBody, NamedBody, SkipBody
from parenting.server.api.names import QueryName
from parenting.server.api.responses import write_responses
from parenting.server.deps import Db, SettingsOf, notify_worker, store
from parenting.server.queue.answers import Said
from parenting.server.queue.names import Names
from parenting.server.queue.revisions import supersede_in, withdraw_in
from parenting.server.queue.skips import skip_in
from parenting.server.receipts import ChangedSchema, SkippedSchema, WithdrawnSchema
from parenting.server.tables import SKIP

router = admitted_router(tags=["questions"])


@router.post(
    "/queries/{query_id}/withdraw",
    summary="Take an answer back",
    responses=write_responses(404, 409, 410),
)
async def withdraw_answer(
    request: Request, query_id: QueryName, body: NamedBody, db: Db, settings: SettingsOf
) -> WithdrawnSchema:
    """Take back an answer of this client that the agent has not heard.

    The outcome is *withdrawn*: the question is open again and leased to this client, and the next answer to
    it is stored as another row. If the agent has heard the answer, the outcome is *heard* and nothing
    changes; send the choice that you want instead to `change`. The same request may be sent again.

    Another client's answer, and an answer in a run that is over, get 409. Names of another database, run or
    question get 410 (`elsewhere`).
    """
    names = Names(body.database, body.run, body.question)
    found = await store(
        request,
        partial(
            withdraw_in,
            db=db,
            query=query_id,
            client_id=body.client_id,
            names=names,
            seconds=settings.lease_seconds,
        ),
    )
    notify_worker(request)
    return WithdrawnSchema(**vars(found))


@router.post(
    "/queries/{query_id}/change",
    summary="Change an answer",
    responses=write_responses(404, 409, 410),
)
async def change_answer(request: Request, query_id: QueryName, body: AnswerBody, db: Db) -> ChangedSchema:
    """Store another answer in the place of one that this client gave.

    The old answer keeps its row and its tick, and stands no more. If the agent has heard it, it hears the new
    one as a correction at a tick of its own: X is rebuilt from the answers that stand. What has happened
    since, such as a move, stays. The same choice changes nothing, so the request may be sent again.

    A question that has no answer, or another client's, gets 409. Names of another database, run or question
    get 410 (`elsewhere`).
    """
    said = Said(body.choice, body.client_id, body.parent, body.replays, body.measures)
    names = Names(body.database, body.run, body.question)
    found = await store(request, partial(supersede_in, db=db, query=query_id, said=said, names=names))
    notify_worker(request)
    return ChangedSchema(**vars(found))


@router.post(
    "/queries/{query_id}/skip",
    summary="Skip a question",
    responses=write_responses(404, 409, 410),
)
async def skip_question(request: Request, query_id: QueryName, body: SkipBody, db: Db) -> SkippedSchema:
    """Say that this question cannot be told. It counts as no answer, and nothing is learnt from it.

    Guidance is set aside: the agent asks about another pair of moves, as long as there is one, and *neither*
    is not said of it. Clips are put back behind all other questions once, and withdrawn when they are skipped
    again. The same request may be sent again; clips that were put back have to be leased again before they
    can be skipped a second time. `withdraw` takes a skip back, and `change` answers what was skipped, whoever
    skipped it.

    A question that was answered, skipped by another client or withdrawn gets 409. Names of another database,
    run or question get 410 (`elsewhere`).
    """
    said = Said(SKIP, body.client_id, body.parent, measured=body.measures)
    names = Names(body.database, body.run, body.question)
    found = await store(request, partial(skip_in, db=db, query=query_id, said=said, names=names))
    notify_worker(request)
    return SkippedSchema(**vars(found))
