"""The parent's page, as a browser without JavaScript and as the page's script call it."""

from __future__ import annotations

import re
import threading
from typing import Any

import httpx2
import pytest
from fastapi import FastAPI
from sqlalchemy import select

from parenting.server import runs
from parenting.server.access import tokens
from parenting.server.access.roles import Role
from parenting.server.audit.entries import entries
from parenting.server.audit.table import Kind
from parenting.server.db import Database
from parenting.server.notify import Notifier
from parenting.server.pages.texts import STATE_TEXTS
from parenting.server.progress import report_progress
from parenting.server.queue import answers, leases
from parenting.server.runs import Claim
from parenting.server.settings import Settings
from parenting.server.statuses import RunState, RunStatus
from parenting.server.tables import Answer, OperatorEvent, Query, Run
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import until
from tests.pages.parent_page import address, form, look, public_id

ME, OTHER = "client-of-mine", "client-of-another"


@pytest.fixture
def life(db: Database) -> tuple[Run, Claim]:
    return fixtures.start_run(db)


@pytest.fixture
def asked(db: Database, life: tuple[Run, Claim]) -> list[int]:
    """A preference question, then guidance: guidance is more urgent."""
    _, mine = life
    return [
        fixtures.ask(db, mine, 3, "preference", fixtures.preference("down down", "left left left")),
        fixtures.ask(db, mine, 4, "guidance", fixtures.guidance("left", "down", start=(1, 2))),
    ]


def rows(db: Database, table: Any) -> Any:
    with db.read() as session:
        return session.scalars(select(table).order_by(table.id)).all()


def test_looking_changes_nothing(client: httpx2.Client, db: Database, asked: list[int]) -> None:
    for path in (address(db), address(db, query=asked[0]), "/runs/1/parent", "/runs/1", "/"):
        assert client.get(path, follow_redirects=True).status_code == 200
    assert [query.leased_by for query in rows(db, Query)] == [None, None]


def test_the_browser_is_known_by_a_cookie(client: httpx2.Client, life: tuple[Run, Claim]) -> None:
    first = look(client)
    cookie = first.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=lax" in cookie
    (name,) = set(re.findall(r'data-client="([^"]+)"', first.text))
    assert f'data-client="{name}"' in look(client).text


def test_a_forged_cookie_is_replaced(client: httpx2.Client, life: tuple[Run, Claim]) -> None:
    client.cookies.set("parenting_client", '"><script>')
    page = look(client).text
    assert '"><script>' not in page


def test_without_javascript_forms_lead_from_question_to_question(
    client: httpx2.Client, db: Database, asked: list[int]
) -> None:
    page = look(client).text
    assert "A question is waiting for you." in page
    assert f'action="{address(db)}/next"' in page
    shown = client.post(f"{address(db)}/next", data={"client_id": ME})
    assert (shown.status_code, shown.headers["location"]) == (303, address(db, query=asked[1]))
    page = client.get(shown.headers["location"]).text
    assert "Which move is better here?" in page
    assert "into the water" in page
    for choice in ("left", "right", "either", "neither"):
        assert f'name="choice" value="{choice}"' in page
    on = client.post(f"{address(db)}/answer", data=form(db, asked[1], client_id=ME, choice="right"))
    assert on.headers["location"] == address(db, query=asked[0])
    client.post(f"{address(db)}/answer", data=form(db, asked[0], client_id=ME, choice="neither"))
    assert [(row.query_id, row.choice, row.client_id) for row in rows(db, Answer)] == [
        (asked[1], "right", ME),
        (asked[0], "neither", ME),
    ]


def test_the_same_form_sent_twice_is_one_answer(
    client: httpx2.Client, db: Database, asked: list[int]
) -> None:
    given = form(db, asked[1], client_id=ME, choice="right")
    assert [client.post(f"{address(db)}/answer", data=given).status_code for _ in range(2)] == [303, 303]
    assert len(rows(db, Answer)) == 1


def test_a_closed_question_says_so_and_leads_on(
    client: httpx2.Client, db: Database, asked: list[int]
) -> None:
    answers.answer(db, asked[1], "left", OTHER, "human")
    given = form(db, asked[1], client_id=ME, choice="right")
    reply = client.post(f"{address(db)}/answer", data=given)
    assert reply.status_code == 409
    assert "already answered by someone else" in reply.text
    assert f'href="{address(db)}"' in reply.text
    assert "Which move" not in look(client, asked[1]).text


@pytest.mark.parametrize(
    ("path", "data", "status"),
    [
        ("/runs/1/parent/answer", {"query_id": 1, "choice": "maybe", "client_id": ME}, 422),
        ("/runs/1/parent/answer", {"query_id": 1, "choice": "left", "client_id": "<script>"}, 422),
        ("/runs/1/parent/answer", {"query_id": 1, "choice": "left", "client_id": ME}, 410),
        ("/runs/9/parent/next", {"client_id": ME}, 404),
        ("/runs/9/parent/question", {"client_id": ME}, 404),
        ("/runs/1/parent/question", {}, 422),
    ],
)
def test_what_does_not_fit_is_refused(
    client: httpx2.Client, db: Database, asked: list[int], path: str, data: dict[str, Any], status: int
) -> None:
    fixtures.start_run(db)
    reply = client.post(path, data=data)
    assert reply.status_code == status
    assert reply.headers["content-type"].startswith("text/html")
    assert "Traceback" not in reply.text
    assert not rows(db, Answer)


def test_a_question_of_another_run_is_not_shown(
    client: httpx2.Client, db: Database, asked: list[int]
) -> None:
    fixtures.start_run(db)
    assert client.get(f"/runs/2/parent?query={asked[0]}").status_code == 404


def test_the_script_gets_the_same_markup(client: httpx2.Client, asked: list[int]) -> None:
    part = client.post("/runs/1/parent/question", data={"client_id": ME}).text
    client.cookies.set("parenting_client", ME)
    page = look(client, asked[1]).text
    assert part.strip().startswith("<form")
    assert part.strip() in page


def test_the_next_question_is_leased_ahead(client: httpx2.Client, db: Database, asked: list[int]) -> None:
    def lease(who: str, *shown: int) -> list[str]:
        data = {"client_id": who, "shown": [names[number] for number in shown]}
        reply = client.post("/runs/1/parent/question", data=data)
        return re.findall(r'data-query="(\w+)"', reply.text) if reply.status_code == 200 else []

    names = {number: public_id(db, number) for number in asked}
    assert lease(ME) == [names[asked[1]]]
    assert lease(ME, asked[1]) == [names[asked[0]]]
    assert lease(ME, *asked) == []
    assert lease(ME) == [names[asked[1]]]  # a reload gives the first again
    assert lease(OTHER) == []
    assert lease(OTHER, asked[0]) == []
    assert [query.leased_by for query in rows(db, Query)] == [ME, ME]


def test_nothing_is_leased_ahead_of_the_goal(client: httpx2.Client, db: Database, asked: list[int]) -> None:
    def offered() -> bool:
        data = {"client_id": ME, "shown": [public_id(db, asked[1])]}
        return client.post("/runs/1/parent/question", data=data).status_code == 200

    runs.set_goal(db, 1, 1)
    assert not offered(), "the one that is shown is the last"
    runs.set_goal(db, 1, 2)
    assert offered()
    answers.answer(db, asked[1], "left", ME, "human")
    assert offered(), "the one that was shown counts once"
    runs.set_goal(db, 1, 1)
    assert not offered()


def test_somebody_elses_question_is_not_promised(
    client: httpx2.Client, db: Database, asked: list[int]
) -> None:
    for number in asked:
        data = {"client_id": OTHER, "shown": public_id(db, number)}
        assert client.post("/runs/1/parent/question", data=data).text
    page = look(client).text
    assert 'data-state="elsewhere"' in page.partition("<main")[2].partition(">")[0]


def test_no_question_is_no_content(client: httpx2.Client, db: Database, life: tuple[Run, Claim]) -> None:
    assert client.post("/runs/1/parent/question", data={"client_id": ME}).status_code == 204
    assert client.post("/runs/1/parent/next", data={"client_id": ME}).headers["location"] == address(db)


def test_while_it_waits_the_page_without_javascript_reloads(
    client: httpx2.Client, db: Database, life: tuple[Run, Claim]
) -> None:
    assert '<noscript><meta http-equiv="refresh"' in look(client).text
    fixtures.ask(db, life[1], 1, "guidance", fixtures.guidance("left", "down"))
    assert 'http-equiv="refresh"' not in look(client).text


@pytest.mark.parametrize("waiting", ["stuck", "unsure"])
def test_a_parent_ends_an_episode_that_stands_still(
    client: httpx2.Client, db: Database, life: tuple[Run, Claim], waiting: str
) -> None:
    link = tokens.make(db, "program", Role.PARENT, run=life[0].id)
    client.headers["Authorization"] = f"Bearer {link.secret}"
    page, end = f"/runs/{life[0].public_id}/parent", f"/runs/{life[0].public_id}/parent/end-episode"
    assert client.post(end).headers["location"] == page
    assert rows(db, OperatorEvent) == [], "it acts: nothing is to be ended"
    report_progress(db, life[1], waiting=waiting)
    shown = client.get(page).text
    assert f'data-state="{waiting}"' in shown.partition("<main")[2].partition(">")[0]
    assert f'action="{end}"' in shown
    for _ in range(2):  # the second press ends nothing more
        assert client.post(end).headers["location"] == page
    assert [event.kind for event in rows(db, OperatorEvent)] == ["end_episode"]
    (told,) = entries(db, kind=Kind.OPERATOR).rows
    assert (told.what, told.who) == ("end episode", f"parent by token {link.token.public_id[:8]}")
    assert client.post(f"/runs/{life[0].id}/event", data={"kind": "end_episode"}).status_code == 403


def test_an_optimal_agent_is_announced(
    client: httpx2.Client, db: Database, life: tuple[Run, Claim], asked: list[int]
) -> None:
    note = re.compile(r'<div id="optimal" class="note"( hidden)?>')
    assert note.search(look(client).text)[1] == " hidden"  # type: ignore[index]
    report_progress(db, life[1], optimal=True)
    assert note.search(look(client).text)[1] == " hidden", "nothing was answered yet"  # type: ignore[index]
    answers.answer(db, asked[0], "left", ME, "human")
    assert note.search(look(client).text)[1] is None  # type: ignore[index]


def state_of(page: httpx2.Response) -> str:
    """The page's sentence on who waits for whom."""
    return page.text.partition("<main")[2].partition('data-state="')[2].partition('"')[0]


def test_the_page_says_who_waits_for_whom(
    client: httpx2.Client, db: Database, life: tuple[Run, Claim]
) -> None:
    """A question is offered while the run is paused; one that is leased is with somebody else."""
    assert state_of(look(client)) == "exploring"
    query = fixtures.ask(db, life[1], 1, "guidance", fixtures.guidance("left", "down"))
    runs.set_status(db, 1, RunStatus.PAUSED)
    assert state_of(look(client)) == "question"
    leases.lease(db, 1, "somebody", 60.0)
    assert state_of(look(client)) == "paused"
    runs.set_status(db, 1, RunStatus.ACTIVE)
    assert state_of(look(client)) == "elsewhere"
    runs.set_goal(db, 1, 1)
    answers.answer(db, query, "left", "somebody", "human")
    assert state_of(look(client)) == "resting"
    runs.set_status(db, 1, RunStatus.STOPPED)
    assert state_of(look(client)) == "over"


def test_every_state_of_a_run_has_its_words_on_the_page() -> None:
    assert set(RunState) <= set(STATE_TEXTS)


def test_a_silent_worker_is_told_of(client: httpx2.Client, db: Database, life: tuple[Run, Claim]) -> None:
    runs.let_go(db, [life[1]])
    assert state_of(look(client)) == "no_worker"


def test_a_request_for_a_question_waits_for_it(
    client: httpx2.Client, site: FastAPI, db: Database, settings: Settings, life: tuple[Run, Claim]
) -> None:
    def post() -> None:
        until(lambda: sum(one.requests for one in list(site.state.streams.subscriptions.values())) == 1)
        fixtures.ask(db, life[1], 1, "guidance", fixtures.guidance("left", "down"))
        Notifier(settings.data, "web").notify()

    agent = threading.Thread(target=post)
    agent.start()
    reply = client.post("/runs/1/parent/question", data={"client_id": ME, "wait": "10"})
    agent.join()
    assert reply.status_code == 200


@pytest.mark.parametrize(
    ("wait", "status"), [("0.1", 204), ("-1", 422), ("11", 422), ("nan", 422), ("x", 422)]
)
def test_it_does_not_wait_for_ever(
    client: httpx2.Client, life: tuple[Run, Claim], wait: str, status: int
) -> None:
    reply = client.post("/runs/1/parent/question", data={"client_id": ME, "wait": wait})
    assert reply.status_code == status
