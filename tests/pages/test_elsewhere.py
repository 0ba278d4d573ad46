"""Two databases at one address: an answer that was given on a page is stored by the one it was meant for."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx2
import pytest
from fastapi import FastAPI
from playwright.sync_api import Route, expect
from sqlalchemy import text

from parenting.server import runs
from parenting.server.db import Database
from parenting.server.group_commit import GroupCommit
from parenting.server.identity import database_id, renew
from parenting.server.pages.texts import parent_title
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from tests.database import migrated
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs, given, kept, until
from tests.pages.parent_page import address, form, look, public_id, shown

RUN, QUESTION = 471100, 882200
KEPT = "this browser keeps it"
STREAM = "**/runs/parent/stream"


@pytest.fixture
def other(tmp_path: Path) -> Iterator[Database]:
    """Another database, with a run and a question of the same numbers."""
    database = migrated(Settings(data=tmp_path / "other", database_url=None))
    renew(database)  # these tests make databases as copies of one
    _, mine = fixtures.start_run(database)
    fixtures.ask(database, mine, 1, "guidance", fixtures.guidance("left", "down", start=(1, 2)))
    yield database
    database.close()


def serve(site: FastAPI, database: Database) -> None:
    """Let another database come to the address, for reads and for the group of writes."""
    site.state.group_commit.close()
    site.state.db, site.state.group_commit = database, GroupCommit(database)


def test_an_answer_waits_in_the_browser_until_its_own_database_is_back(
    tabs: BrowserTabs, site: FastAPI, db: Database, other: Database, ask: Callable[..., int]
) -> None:
    tabs.expected = ("404", "410", "net::ERR_FAILED")
    number = ask()
    page = tabs.open("/")
    page.context.route("**/events*", lambda route: route.abort())  # as if the server had been started again
    page.context.route(STREAM, lambda route: route.abort())  # one that is open would go on with the old one
    page.goto(tabs.address + address(db))
    shown(page, number)
    serve(site, other)
    page.context.unroute(STREAM)
    with page.expect_request("**/answer") as sent:
        page.keyboard.press("b")
    expect(page.locator("#alert")).to_contain_text(KEPT)
    expect(page.locator("#saved")).to_have_text("Kept here, not stored")
    expect(page.get_by_role("heading", name="This run is not here.")).to_be_visible()
    names = form(db, number, run=runs.get_run(db, 1).public_id)
    assert sent.value.url.endswith(f"/api/v1/queries/{names['question']}/answer")
    body = {
        "choice": "right",
        "replays": 0,
        "client_id": page.locator("#main").get_attribute("data-client"),
        **names,
    }
    told = json.loads(sent.value.post_data or "")
    measured = told.pop("measured")
    assert told == body
    assert (measured["layout"], measured["input"], measured["away"]) == ("one", "key", 0)
    assert body.items() <= kept(page)[0].items()
    said = f"Your answer to “{parent_title(runs.get_run(db, 1))}” of "
    expect(page.locator("#alert")).to_contain_text(said)
    expect(page.locator("#alert")).to_contain_text(f"belongs to the database {names['database'][:8]}, which")

    theirs = page.context.new_page()
    theirs.goto(tabs.address + address(other))
    expect(theirs.locator("#alert")).to_contain_text(KEPT)
    shown(theirs, number)
    theirs.keyboard.press("a")
    until(lambda: given(other) == [(number, "left")])
    until(lambda: len(kept(page)) == 1)
    theirs.close()
    assert given(db) == []

    serve(site, db)
    until(lambda: given(db) == [(number, "right")])
    expect(page.locator("#saved")).to_have_text("Saved")
    until(lambda: kept(page) == [])
    assert given(other) == [(number, "left")]


@pytest.mark.slow
def test_a_page_of_the_original_is_asked_anew_by_a_renewed_copy(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    tabs.expected = ("410",)
    number = ask()
    page = tabs.open(address(db))
    shown(page, number)
    before = database_id(db)
    renew(db)
    page.keyboard.press("b")
    expect(page.locator("#alert")).to_contain_text(KEPT)
    expect(page.locator("#question")).to_have_attribute("data-database", database_id(db))
    page.keyboard.press("a")
    until(lambda: given(db) == [(number, "left")])
    until(lambda: [(answer["database"], answer["choice"]) for answer in kept(page)] == [(before, "right")])


@pytest.mark.slow
def test_an_answer_of_the_old_version_is_kept_and_not_sent(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    """It names its question by a number alone, which may be another question by now."""
    number = ask()
    old = {"query": number, "choice": "right", "client_id": "somebody"}
    page = tabs.open("/")
    page.evaluate("text => localStorage.setItem('parenting.answers', text)", json.dumps([old]))
    page.goto(tabs.address + address(db))
    shown(page, number)
    expect(page.locator("#alert")).to_contain_text(KEPT)
    page.keyboard.press("a")
    until(lambda: given(db) == [(number, "left")])
    until(lambda: kept(page) == [old])


@pytest.mark.slow
def test_what_a_server_cannot_read_is_kept(tabs: BrowserTabs, db: Database, ask: Callable[..., int]) -> None:
    """Such as one of an older version, which knows no public ids: only a conflict settles an answer."""
    tabs.expected = ("422",)
    number = ask()
    page = tabs.open(address(db))
    shown(page, number)

    def older(route: Route) -> None:
        route.fulfill(status=422, json={"error": {"code": "invalid", "message": "query_id: not an integer"}})

    page.context.route("**/answer", older)
    page.keyboard.press("b")
    expect(page.locator("#alert")).to_contain_text(KEPT)
    page.context.unroute("**/answer")
    page.reload()
    until(lambda: given(db) == [(number, "right")])
    until(lambda: kept(page) == [])


def test_an_answer_that_the_server_fails_on_holds_up_no_other(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    tabs.expected = ("500",)
    numbers = [ask("preference", "down down", "left") for _ in range(2)]
    page = tabs.open(address(db))
    shown(page, numbers[0])

    def fail(route: Route) -> None:
        route.fulfill(status=500, json={"error": {"code": "damaged", "message": "damaged"}})

    page.context.route(f"**/{public_id(db, numbers[0])}/answer", fail)
    page.keyboard.press("b")
    shown(page, numbers[1])
    page.keyboard.press("a")
    until(lambda: [answer["choice"] for answer in kept(page)] == ["right"])
    assert given(db) == [(numbers[1], "left")]


@pytest.fixture
def counted(db: Database) -> Database:
    """A database whose run and question have numbers that stand out in a text."""
    with db.write() as session:
        session.execute(
            text(f"UPDATE database_identity SET last_run = {RUN - 1}, last_query = {QUESTION - 1}")
        )
    _, mine = fixtures.start_run(db, goal=5)
    assert mine.run_id == RUN
    asked = fixtures.ask(db, mine, 1, "guidance", fixtures.guidance("left", "down", start=(1, 2)))
    assert asked == QUESTION
    return db


def pages(client: httpx2.Client, db: Database) -> Iterator[httpx2.Response]:
    """All that a parent gets: the pages of the run in each state, a question, and replies to the forms."""
    here, me = address(db, RUN), {"client_id": "client-of-mine"}
    yield look(client, run=RUN)
    yield look(client, QUESTION, run=RUN)
    yield client.post(f"{here}/question", data=me)
    yield client.post(f"{here}/next", data=me)
    answer = form(db, QUESTION, choice="left", **me)
    for sent in (answer, {**answer, "choice": "right"}, {**answer, "client_id": "another"}):
        yield client.post(f"{here}/answer", data=sent)
    yield client.post(f"{here}/answer", data={**answer, "question": "1" * 22})
    yield look(client, QUESTION, run=RUN)
    for path, data in (
        ("goal", {"goal": "1"}),
        ("status", {"status": "paused"}),
        ("event", {"kind": "end_episode"}),
    ):
        yield client.post(f"{here.removesuffix('/parent')}/{path}", data={**data, "back": "parent"})
        yield look(client, run=RUN)
    runs.set_status(db, RUN, RunStatus.STOPPED)
    yield look(client, run=RUN)
    yield client.post(f"{here.removesuffix('/parent')}/goal", data={"goal": "9", "back": "parent"})


def others(client: httpx2.Client, db: Database) -> Iterator[httpx2.Response]:
    """The targets of links and forms of dashboard and history."""
    dashboard = address(db, RUN).removesuffix("/parent")
    for path in (
        dashboard,
        f"{dashboard}/history",
        f"{dashboard}/history?kind=guidance",
        f"{dashboard}/stages",
    ):
        yield client.get(path)
    for path, wrong in (("goal", {"goal": "x"}), ("pace", {"pace": "x"}), ("probabilities", {"p_guid": "2"})):
        yield client.post(f"{dashboard}/{path}", data=wrong)
    yield client.post(f"{dashboard}/event", data={"kind": "mature"})
    yield client.post(f"{dashboard}/status", data={"status": "paused"})
    with db.write() as session:
        session.execute(text("UPDATE run SET status = 'failed', reason = 'The disk was full.'"))
        session.execute(text("UPDATE query SET clips = '[1,'"))
    for path in (dashboard, f"{dashboard}/history", f"{dashboard}/parent"):
        yield client.get(path)
    yield client.get(f"{dashboard}/parent?query={public_id(db, QUESTION)}")
    with db.write() as session:
        session.execute(text("UPDATE run SET config = '[1,'"))
    for path in (dashboard, f"{dashboard}/history", f"{dashboard}/parent"):
        yield client.get(path)


@pytest.mark.slow
def test_no_number_of_a_run_or_a_question_reaches_a_parent(client: httpx2.Client, counted: Database) -> None:
    got = list(pages(client, counted))
    assert {reply.status_code for reply in got} == {200, 303, 409, 410}
    got += others(client, counted)
    for reply in got:
        # The second line of the dashboard, which no link of a parent opens, names the run as researchers do.
        said = reply.text.replace(f"Run {RUN}: ", "", 1) + str(reply.headers)
        assert not re.search(f"{RUN}|{QUESTION}", said), said
        assert not re.search(r"/runs/\d+\b", said), said


def test_an_error_leads_back_to_a_run_whose_name_begins_with_a_digit(
    client: httpx2.Client, counted: Database
) -> None:
    name = "6" * 22
    with counted.write() as session:
        session.execute(text(f"UPDATE run SET public_id = '{name}'"))
    answer = form(counted, QUESTION, choice="left", client_id="client-of-mine")
    client.post(f"/runs/{name}/parent/answer", data=answer)
    other = client.post(f"/runs/{name}/parent/answer", data={**answer, "choice": "right"})
    assert other.status_code == 409
    assert f'href="/runs/{name}/parent"' in other.text


def test_a_number_would_be_found(client: httpx2.Client, counted: Database) -> None:
    """The control: the researcher's list has them."""
    assert f"run {RUN}</bdi>" in client.get("/").text


@pytest.mark.parametrize("query", [None, QUESTION])
def test_an_old_address_leads_to_the_public_one(
    client: httpx2.Client, counted: Database, query: int | None
) -> None:
    old = f"/runs/{RUN}/parent" + (f"?query={query}" if query else "")
    moved = client.get(old, follow_redirects=False)
    assert (moved.status_code, moved.headers["location"]) == (307, address(counted, RUN, query))
    assert client.get(moved.headers["location"]).status_code == 200
    for page in ("", "/history", "/history?kind=guidance&choice=left"):
        moved = client.get(f"/runs/{RUN}{page}", follow_redirects=False)
        there = address(counted, RUN).removesuffix("/parent") + page
        assert (moved.status_code, moved.headers["location"]) == (307, there)
    half = client.get(f"{address(counted, RUN)}?query={QUESTION}", follow_redirects=False)
    assert (half.status_code, half.headers["location"]) == (307, address(counted, RUN, QUESTION))


def test_a_question_of_another_run_or_of_none_is_not_found(client: httpx2.Client, counted: Database) -> None:
    fixtures.start_run(counted)
    for query in (public_id(counted, QUESTION), QUESTION, "1" * 22, "0", "x"):
        assert client.get(f"{address(counted, RUN + 1)}?query={query}").status_code == 404


def test_the_cookie_goes_to_this_host_and_to_no_script(client: httpx2.Client, counted: Database) -> None:
    cookie = look(client, run=RUN).headers["set-cookie"].lower()
    parts = {part.strip().partition("=")[0] for part in cookie.split(";")}
    assert {"httponly", "samesite"} <= parts
    assert "domain" not in parts, "other hosts of a domain do not get it"
