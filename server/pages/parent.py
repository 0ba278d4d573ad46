"""The parent's page: one question after another, with JavaScript or without.

No GET changes anything: a question is leased by a POST, which without JavaScript redirects to the page that
shows it. Who answers is a random name in a cookie, so that a reload and a second tab get the same question;
a form carries it too, for browsers that keep no cookies.
"""

from __future__ import annotations

import re
import secrets
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Annotated

from fastapi import APIRouter, Form, Query, Request, Response
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from parenting.server import runs, tables
from parenting.server.api.bodies import Choice, ClientId, RunId
from parenting.server.db import Database
from parenting.server.deps import Db, SettingsOf, notify_worker
from parenting.server.errors import NotFound
from parenting.server.new_run import LARGEST_INT
from parenting.server.pages.question import QuestionView, question_view
from parenting.server.pages.render import page, redirect
from parenting.server.pages.texts import GOAL_STEP, STATE_TEXTS, run_title
from parenting.server.queue import answers, leases
from parenting.server.queue.leases import lease_ahead, may_lease
from parenting.server.reads.schemas import run_schema
from parenting.server.statuses import RunState
from parenting.server.streams import Streams
from parenting.server.tables import Run

router = APIRouter(include_in_schema=False)

COOKIE = "parenting_client"
YEAR = 365 * 24 * 3600
NAME = re.compile(r"[A-Za-z0-9_-]{8,64}")
PATIENCE = 0.5
"""Seconds for which a plain form waits for the next question before the page says that the agent explores."""

ClientField = Annotated[ClientId, Form()]
ChoiceField = Annotated[Choice, Form()]
Number = Annotated[int, Form(ge=1, le=LARGEST_INT)]
Numbers = Annotated[tuple[Annotated[int, Field(ge=1, le=LARGEST_INT)], ...], Form(max_length=100)]
Seconds = Annotated[float, Form(ge=0, le=10, allow_inf_nan=False)]
QueryShown = Annotated[int | None, Query(ge=1, le=LARGEST_INT)]


@dataclass(frozen=True)
class ParentPage:
    """The content of web/templates/parent.html."""

    run: Run
    title: str
    client: str  # the random name of who answers
    shown: QuestionView | None  # the question on the page
    state: str  # which of `sentences` holds while there is none
    sentences: Mapping[str, tuple[str, str]]  # heading and sentence of each state
    more: int  # answers that the goal grows by
    refresh: bool  # without JavaScript the page reloads until a question is there


@router.get("/runs/{run_id}/parent")
def parent_page(request: Request, run_id: RunId, db: Db, query: QueryShown = None) -> Response:
    """The page; with `query` it shows that question, as the forms do. Changes nothing."""
    run = runs.get_run(db, run_id)
    client = _client(request)
    shown = None if query is None else _open_question(db, run, query)
    now = _page_state(run_schema(db, run_id).state, may_lease(db, run_id, client))
    refresh = shown is None and now in ("exploring", "no_worker", "elsewhere")
    context = ParentPage(run, run_title(run), client, shown, now, STATE_TEXTS, GOAL_STEP, refresh)
    response = page("parent.html", **vars(context))
    response.set_cookie(COOKIE, client, max_age=YEAR, httponly=True, samesite="lax")
    return response


@router.post("/runs/{run_id}/parent/question")
async def question(
    request: Request,
    run_id: RunId,
    db: Db,
    settings: SettingsOf,
    client_id: ClientField,
    shown: Numbers = (),
    wait: Seconds = 0.0,
) -> Response:
    """For the script: the next question as markup, leased; 204 if there is none within `wait` seconds.

    `shown` are those that the page has already or whose answers are on their way: it asks for another one.
    The request lies here until the agent asks, also while the parent still thinks about the last question:
    when the next one comes, its reply is on its way at once.
    """
    streams: Streams = request.app.state.streams
    run = await run_in_threadpool(runs.get_run, db, run_id)
    lease = partial(_lease_next, db, run_id, client_id, shown, settings.lease_seconds)
    query = await streams.wait_for(lease, wait, request.is_disconnected)
    if query is None:
        return Response(status_code=204)
    if await request.is_disconnected():  # it left while the question was looked up
        await run_in_threadpool(leases.release, db, query.id, client_id)
    return await run_in_threadpool(_markup, run, query, client_id)


@router.post("/runs/{run_id}/parent/next")
def next_question(run_id: RunId, db: Db, settings: SettingsOf, client_id: ClientField) -> Response:
    """For the form: lease the next question and go to it."""
    runs.get_run(db, run_id)
    return _go_on(db, run_id, client_id, settings.lease_seconds)


@router.post("/runs/{run_id}/parent/answer")
def answer(
    request: Request,
    run_id: RunId,
    db: Db,
    settings: SettingsOf,
    query_id: Number,
    choice: ChoiceField,
    client_id: ClientField,
) -> Response:
    """For the form: store the answer, then go to the next question. A closed question says so (409)."""
    if answers.get_query(db, query_id).run_id != run_id:
        raise NotFound(f"Question {query_id} is not one of run {run_id}.")
    answers.answer(db, query_id, choice, client_id, parent="human")
    notify_worker(request)
    return _go_on(db, run_id, client_id, settings.lease_seconds, patience=PATIENCE)


def _lease_next(
    db: Database, run_id: int, client_id: str, shown: tuple[int, ...], seconds: float
) -> tables.Query | None:
    if shown:
        return lease_ahead(db, run_id, client_id, shown, seconds)
    return leases.lease(db, run_id, client_id, seconds)


def _markup(run: Run, query: tables.Query, client_id: str) -> Response:
    return page("_question.html", shown=question_view(query, run), client=client_id)


def _go_on(db: Database, run_id: int, client_id: str, seconds: float, patience: float = 0.0) -> Response:
    """To the next question, which may come within `patience` seconds, or to the page that waits for it."""
    until = time.monotonic() + patience
    while (query := leases.lease(db, run_id, client_id, seconds)) is None and time.monotonic() < until:
        time.sleep(0.02)
    return redirect(f"/runs/{run_id}/parent" + (f"?query={query.id}" if query else ""))


def _open_question(db: Database, run: Run, query_id: int) -> QuestionView | None:
    query = answers.get_query(db, query_id)
    if query.run_id != run.id:
        raise NotFound(f"Question {query_id} is not one of run {run.id}.")
    return question_view(query, run) if query.status == "open" else None


def _page_state(state: RunState, offered: bool) -> str:
    """Return which of `STATE_TEXTS` holds for one parent.

    A question is offered while the run is paused, too. A question that is not offered is with somebody else.
    """
    if state in (RunState.OVER, RunState.RESTING):
        return state
    if offered:
        return "question"
    return "elsewhere" if state is RunState.QUESTION else state


def _client(request: Request) -> str:
    known = request.cookies.get(COOKIE, "")
    return known if NAME.fullmatch(known) else secrets.token_urlsafe(16)
