"""The parent's page: one question after another, with JavaScript or without.

No GET changes anything: a question is leased by a POST, which without JavaScript redirects to the page that
shows it. Who answers is a random name in a cookie, so that a reload and a second tab get the same question;
a form carries it too, for browsers that keep no cookies.
"""

from __future__ import annotations

import re
import secrets
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Annotated

from fastapi import Form, Query, Request, Response

from parenting.drawing.sentences import mark
from parenting.server import runs, tables
from parenting.server.access.guard import principal_of, require_own_question
from parenting.server.access.staying import Stay
from parenting.server.admission import admitted_router
from parenting.server.api.names import PublicId, RunId, RunName, read_name
from parenting.server.db import Database
from parenting.server.deps import Db, SettingsOf, notify_worker, store
from parenting.server.errors import DamagedRowError, ElsewhereError, NotFound
from parenting.server.identity import database_id
from parenting.server.measures import BY_FORM
from parenting.server.pages.fields import ChoiceField, ClientField, MaybeDatabase, MaybeQuestion
from parenting.server.pages.practice import PRACTISED, Place
from parenting.server.pages.question import Former, QuestionView, repeated_view
from parenting.server.pages.render import page, redirect, remember
from parenting.server.pages.texts import GOAL_STEP, STATE_TEXTS, parent_title
from parenting.server.public_ids import LENGTH
from parenting.server.queue import answers, leases
from parenting.server.queue.leases import may_lease
from parenting.server.queue.names import Names
from parenting.server.queue.presence import holder
from parenting.server.reads.names import query_number, query_numbers
from parenting.server.reads.own_answers import changeable, last_of
from parenting.server.reads.schemas import run_schema
from parenting.server.seats import COOKIE
from parenting.server.statuses import RunState
from parenting.server.streams import Streams
from parenting.server.tables import Run

router = admitted_router(include_in_schema=False)

NAME = re.compile(r"[A-Za-z0-9_-]{8,64}")
PATIENCE = 0.5
"""Seconds for which a plain form waits for the next question before the page says that the agent explores."""

BY_NUMBER = mark(
    "This form is of an older version and names its question by a number, which may be another question by "
    "now. Its answer was not stored. Open the page again."
)

Shown = Annotated[tuple[PublicId, ...], Form(max_length=100)]
Seconds = Annotated[float, Form(ge=0, le=10, allow_inf_nan=False)]
QueryShown = Annotated[str | None, Query(max_length=LENGTH)]


@dataclass(frozen=True)
class ParentPage:
    """The content of web/templates/parent.html. No number of a run or a question is in it."""

    run: Run
    title: str
    database: str  # the UUID that an answer names
    client: str  # the random name of who answers
    shown: QuestionView | None  # the question on the page
    state: str  # which of `sentences` holds while there is none
    sentences: Mapping[str, tuple[str, str]]  # heading and sentence of each state
    more: int  # answers that the goal grows by
    holder: str  # the name by which the stream tells of this client's leases
    attention: float  # seconds after a sign of life for which questions are held
    listen_after: int  # milliseconds that a question is on the screen before it takes an answer
    refresh: bool  # without JavaScript the page reloads until a question is there
    last: QuestionView | None  # the last answer of this client, with its question


@router.get("/runs/{run_id}/parent")
def parent_page(
    request: Request,
    run_id: RunId,
    db: Db,
    settings: SettingsOf,
    query: QueryShown = None,
    change: bool = False,
) -> Response:
    """The page; with `query` it shows that question, as the forms do. Changes nothing.

    With `change` the question is one that this client has answered, and its form changes the answer.

    Its address carries the run's public id. A researcher who writes the number is led there.
    """
    run = runs.get_run(db, run_id)
    asked = None if query is None else question_of(db, run, query)
    if request.path_params["run_id"] != run.public_id or (asked is not None and query != asked.public_id):
        return redirect(address(run, asked, change), status=307)
    if run.practice == "required" and PRACTISED not in request.cookies:
        return redirect(Place(run=run.public_id).address())
    client = client_of(request)
    if asked is not None:
        require_own_question(request, db, asked.public_id)
    shown = None if asked is None else _shown(db, run, asked, client, change)
    now = _page_state(run_schema(db, run_id).state, may_lease(db, run_id, client))
    refresh = shown is None and now in ("exploring", "no_worker", "elsewhere")
    here = database_id(db)
    title, last = parent_title(run), _last(db, run, client)
    who, attention, after = holder(client), settings.attention_seconds, settings.listen_after_ms
    states = (now, STATE_TEXTS, GOAL_STEP)
    context = ParentPage(run, title, here, client, shown, *states, who, attention, after, refresh, last)
    response = page("parent.html", **vars(context))
    remember(request, response, COOKIE, client)
    return response


@router.get("/help")
def help_dialog() -> Response:
    """For the script: the dialog on how to answer, with all keys."""
    return page("_help.html")


@router.post("/runs/{run_id}/parent/question")
async def question(
    request: Request,
    run_id: RunId,
    db: Db,
    settings: SettingsOf,
    client_id: ClientField,
    shown: Shown = (),
    wait: Seconds = 0.0,
    take: bool = Form(False),
) -> Response:
    """For the script: the next question as markup, leased; 204 if there is none within `wait` seconds.

    `shown` are those that the page has already or whose answers are on their way: it asks for another one.
    The request lies here until the agent asks, also while the parent still thinks about the last question:
    when the next one comes, its reply is on its way at once. With `take` a question that somebody else holds
    comes here where none is free.
    """
    streams: Streams = request.app.state.streams
    run = await streams.admission.read(runs.get_run, db, run_id)
    numbers = await streams.admission.read(query_numbers, db, shown)
    wish = leases.wanted(db, run_id, client_id, settings.lease_seconds, numbers or None)
    if take:
        wish = leases.taken(db, run_id, client_id, settings.lease_seconds)
    query = await wait_for(request, run_id, wish, wait)
    if query is None:
        return Response(status_code=204)
    if await request.is_disconnected():  # it left while the question was looked up
        await store(request, partial(leases.release_in, query_id=query.id, client_id=client_id))
    return await streams.admission.read(_markup, db, run, query, client_id)


@router.post("/runs/{run_id}/parent/next")
def next_question(run_id: RunId, db: Db, settings: SettingsOf, client_id: ClientField) -> Response:
    """For the form: lease the next question and go to it."""
    run = runs.get_run(db, run_id)
    return redirect(address(run, leases.lease(db, run.id, client_id, settings.lease_seconds)))


@router.post("/runs/{run_id}/parent/take")
def take_question(run_id: RunId, db: Db, settings: SettingsOf, client_id: ClientField) -> Response:
    """For the form: take the question over, whoever holds it, and go to it."""
    run = runs.get_run(db, run_id)
    return redirect(address(run, leases.take(db, run.id, client_id, settings.lease_seconds)))


@router.post("/runs/{run_id}/parent/answer")
async def answer(
    request: Request,
    run_id: RunName,
    db: Db,
    settings: SettingsOf,
    choice: ChoiceField,
    client_id: ClientField,
    database: MaybeDatabase = None,
    question: MaybeQuestion = None,
) -> Response:
    """For the form: store the answer, then go to the next question.

    A closed question says so (409). An answer for another database, run or question is not stored (410).
    """
    if isinstance(run_id, int) or database is None or question is None:
        raise ElsewhereError(BY_NUMBER)
    names = Names(database, run_id, question)
    streams: Streams = request.app.state.streams
    await streams.admission.read(require_own_question, request, db, question)
    said = answers.Said(choice, client_id, "human", measured=BY_FORM)
    stored = await store(request, partial(answers.answer_in, db=db, query=question, said=said, names=names))
    notify_worker(request)
    run = await streams.admission.read(runs.get_run, db, stored.run)
    wish = leases.wanted(db, run.id, client_id, settings.lease_seconds)
    return redirect(address(run, await wait_for(request, run.id, wish, PATIENCE)))


async def wait_for(request: Request, run_id: int, wish: leases.Wish, seconds: float) -> tables.Query | None:
    """Hold the question that a page wishes for, once there is one; None if none comes in time."""
    look = partial(store, request, wish.hold, durable=False, worth=wish.is_offered)
    streams: Streams = request.app.state.streams
    return await streams.wait_for(run_id, look, seconds, Stay(request).is_left)


def _markup(db: Database, run: Run, query: tables.Query, client_id: str) -> Response:
    shown = repeated_view(db, query, run)
    return page("_question.html", shown=shown, client=client_id, database=database_id(db))


def _shown(db: Database, run: Run, asked: tables.Query, client: str, change: bool) -> QuestionView | None:
    """Return the question that an address names, if it waits, or if its answer is to be changed."""
    if asked.status == "open":
        return repeated_view(db, asked, run)
    found = changeable(db, asked.id, client) if change else None
    if found is None:
        return None
    return repeated_view(db, asked, run, Former(found.answer.choice, asked.status == "applied"))


def _last(db: Database, run: Run, client: str) -> QuestionView | None:
    """Return the question that this client answered last, unless it cannot be shown."""
    found = last_of(db, run.id, client)
    if found is None:
        return None
    with suppress(DamagedRowError):
        return repeated_view(
            db, found.query, run, Former(found.answer.choice, found.query.status == "applied")
        )
    return None


def address(run: Run, query: tables.Query | None, change: bool = False) -> str:
    """Return the address of a run's parent's page, which shows a question, perhaps to change its answer."""
    named = f"?query={query.public_id}" + ("&change=true" if change else "") if query else ""
    return f"/runs/{run.public_id}/parent{named}"


def question_of(db: Database, run: Run, name: str) -> tables.Query:
    """Return the question that an address names by its public id, or an older address by its number.

    Raises:
        NotFound: it is not one of this run.
    """
    try:
        query = answers.get_query(db, query_number(db, read_name(name)))
    except (ValueError, NotFound):
        query = None
    if query is None or query.run_id != run.id:
        raise NotFound(mark("This question is not one of this run."))
    return query


def _page_state(state: RunState, offered: bool) -> str:
    """Return which of `STATE_TEXTS` holds for one parent.

    A question is offered while the run is paused, too. A question that is not offered is with somebody else.
    """
    if state in (RunState.OVER, RunState.RESTING):
        return state
    if offered:
        return "question"
    return "elsewhere" if state is RunState.QUESTION else state


def client_of(request: Request) -> str:
    """Return the name of who answers: that of the link they came by, or the random one of this browser."""
    who = principal_of(request)
    if who.client is not None:
        return who.client
    known = request.cookies.get(COOKIE, "")
    return known if NAME.fullmatch(known) else secrets.token_urlsafe(16)
