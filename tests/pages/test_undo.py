"""Undo: the last answer is taken back or changed, by key, by button, from the history, and by plain forms."""

from __future__ import annotations

import re
from collections.abc import Callable

import httpx2
import pytest
from playwright.sync_api import expect
from sqlalchemy import select

from parenting.server.db import Database
from parenting.server.notify import Notifier
from parenting.server.queue.answers import answer, get_query
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.runs import Claim, get_run, set_status
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from parenting.server.tables import Answer
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs, until
from tests.pages.parent_page import address, form, public_id, shown

ME, OTHER = "client-of-mine", "client-of-another"


def stored(db: Database) -> list[tuple[str, bool]]:
    """The choices that were stored, each with whether it stands."""
    with db.read() as session:
        rows = session.scalars(select(Answer).order_by(Answer.number)).all()
        return [(row.choice, row.standing) for row in rows]


def guidance(db: Database, mine: Claim, tick: int) -> int:
    return fixtures.ask(db, mine, tick, "guidance", fixtures.guidance("left", "down", start=(1, 2)))


def test_plain_forms_take_back_and_change(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    query, here = guidance(db, mine, 1), address(db)
    client.cookies.set("parenting_client", ME)
    assert re.search(r'id="undo"[^>]* hidden', client.get(here).text)
    answer(db, query, "right", ME, "human")
    page = client.get(here).text
    assert not re.search(r'id="undo"[^>]* hidden', page)
    assert '<span id="undone">B, down</span>' in page
    fields = form(db, query, client_id=ME)
    back = client.post(f"{here}/withdraw", data=fields)
    assert back.headers["location"] == address(db, query=query)
    assert 'action="' + here + '/answer"' in client.get(back.headers["location"]).text
    assert stored(db) == [("right", False)]
    answer(db, query, "left", ME, "human")
    take_answer(db, mine, 2)
    back = client.post(f"{here}/withdraw", data=fields)
    assert back.headers["location"].endswith("&change=true")
    page = client.get(back.headers["location"]).text
    assert "The move has happened" in page
    assert 'action="' + here + '/change"' in page
    assert len(re.findall(r'value="left"[^>]* aria-pressed="true"', page)) == 1
    assert page.count('aria-pressed="true"') == 1
    assert client.post(f"{here}/change", data={**fields, "choice": "neither"}).status_code == 303
    assert stored(db) == [("right", False), ("left", False), ("neither", True)]


def test_only_ones_own_answer_is_shown_to_be_changed(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    query = guidance(db, mine, 1)
    answer(db, query, "left", OTHER, "human")
    client.cookies.set("parenting_client", ME)
    there = f"{address(db, query=query)}&change=true"
    assert 'id="question"' not in client.get(there).text
    assert "Change this answer" not in client.get("/runs/1/history").text
    client.cookies.clear()
    client.cookies.set("parenting_client", OTHER)
    assert 'id="question"' in client.get(there).text
    assert f"query={public_id(db, query)}&amp;change=true" in client.get("/runs/1/history").text
    refused = client.post(f"{address(db)}/change", data=form(db, query, client_id=ME, choice="right"))
    assert refused.status_code == 409
    elsewhere = {**form(db, query, client_id=OTHER), "database": "7c9e6679-7425-40de-944b-e07fc1f90ae7"}
    assert client.post(f"{address(db)}/withdraw", data=elsewhere).status_code == 410
    assert stored(db) == [("left", True)]


def test_z_asks_again_and_the_history_changes(
    tabs: BrowserTabs, db: Database, mine: Claim, ask: Callable[..., int]
) -> None:
    first, second = ask(), ask()
    page = tabs.open(address(db))
    shown(page, first)
    page.keyboard.press("b")
    shown(page, second)
    until(lambda: stored(db) == [("right", True)])
    expect(page.locator("#undo button")).to_contain_text("Undo: B, down")
    page.keyboard.press("z")
    shown(page, first)
    expect(page.locator("#undo")).to_be_hidden()
    until(lambda: stored(db) == [("right", False)])
    expect(page.locator("#count")).to_have_text("0")
    page.keyboard.press("a")
    until(lambda: stored(db) == [("right", False), ("left", True)])
    expect(page.locator("#count")).to_have_text("1")
    assert take_answer(db, mine, 50) is not None
    page.keyboard.press("z")
    expect(page.locator(".again")).to_contain_text(re.compile(r"Your answer: [AB], (up|down|left|right)\."))
    assert get_query(db, first).status == "applied"
    expect(page.locator("#said")).not_to_be_empty()  # the script has begun
    page.wait_for_selector("#question[data-listening]")
    page.keyboard.press("e")
    until(lambda: stored(db)[-1] == ("either", True))
    expect(page.locator(".again")).to_have_count(0)
    page.goto(tabs.address + f"/runs/{get_run(db, 1).public_id}/history")
    page.get_by_role("link", name="Change this answer").click()
    expect(page.locator(".again")).to_contain_text("Your answer: Either.")
    page.locator(".answers [value=neither]").click()
    until(lambda: stored(db)[-1] == ("neither", True))
    assert [standing for _, standing in stored(db)] == [False, False, False, True]


def test_a_change_without_a_connection_is_kept_and_sent(
    tabs: BrowserTabs, db: Database, mine: Claim, ask: Callable[..., int]
) -> None:
    tabs.expected = ("net::ERR_INTERNET_DISCONNECTED",)
    first = ask()
    page = tabs.open(address(db))
    shown(page, first)
    page.keyboard.press("a")
    until(lambda: stored(db) == [("left", True)])
    assert take_answer(db, mine, 2) is not None
    page.keyboard.press("z")
    expect(page.locator(".again")).to_contain_text("Your answer: A, left.")
    shown(page, first)
    expect(page.locator("#undo")).to_be_hidden()
    page.context.set_offline(True)
    page.keyboard.press("b")
    expect(page.locator("#saved")).to_have_text("Kept here, not sent yet")
    expect(page.locator("#undo button")).to_contain_text("Undo: B, down")
    assert stored(db) == [("left", True)]
    page.context.set_offline(False)
    expect(page.locator("#saved")).to_have_text("Saved")
    assert stored(db) == [("left", False), ("right", True)]
    expect(page.locator("#count")).to_have_text("1")


@pytest.mark.slow
def test_an_undo_that_is_not_sent_says_so_until_the_server_is_here_again(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    tabs.expected = ("net::ERR_INTERNET_DISCONNECTED", "net::ERR_FAILED")
    first, second = ask(), ask()
    page = tabs.open(address(db))
    shown(page, first)
    page.keyboard.press("b")
    expect(page.locator("#saved")).to_have_text("Saved")
    shown(page, second)
    page.context.set_offline(True)
    page.keyboard.press("z")
    expect(page.locator("#alert")).to_contain_text("The server cannot be reached")
    page.context.set_offline(False)
    expect(page.locator("#alert")).to_be_empty()
    assert stored(db) == [("right", True)]
    page.route("**/answer", lambda route: route.abort())
    page.keyboard.press("a")
    expect(page.locator("#saved")).to_have_text("Kept here, not sent yet")
    page.clock.install()
    page.keyboard.press("z")
    page.clock.run_for(3000)  # for which it waits for the answer to go
    expect(page.locator("#alert")).to_contain_text("Your last answer is not sent yet.")
    page.unroute("**/answer")
    page.clock.run_for(5000)
    expect(page.locator("#alert")).to_be_empty()
    expect(page.locator("#saved")).to_have_text("Saved")


@pytest.mark.slow
def test_a_run_that_is_over_offers_no_undo(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int], settings: Settings
) -> None:
    page = tabs.open(address(db))
    shown(page, ask())
    page.keyboard.press("b")
    expect(page.locator("#saved")).to_have_text("Saved")
    expect(page.locator("#undo")).to_be_visible()
    set_status(db, 1, RunStatus.STOPPED)
    Notifier(settings.data, "web").notify()
    expect(page.get_by_role("heading", name="This run is over.")).to_be_visible()
    expect(page.locator("#undo")).to_be_hidden()
    page.reload()
    expect(page.locator("#undo")).to_be_hidden()


def test_a_refused_undo_gives_way_to_the_one_before(tabs: BrowserTabs, db: Database, mine: Claim) -> None:
    """Somebody else has answered what was skipped here."""
    tabs.expected = ("409",)
    clips = fixtures.guidance("left", "down", start=(1, 2))
    first, second = (post_query(db, mine, tick, "preference", 1, clips) for tick in (1, 2))
    page = tabs.open(address(db))
    shown(page, first)
    page.keyboard.press("b")
    shown(page, second)
    page.keyboard.press("s")
    until(lambda: len(stored(db)) == 2)
    answer(db, second, "right", OTHER, "human")
    page.keyboard.press("z")
    expect(page.locator("#alert")).to_contain_text("answered by someone else")
    expect(page.locator("#undo button")).to_contain_text("Undo: Right")
    page.keyboard.press("z")
    until(lambda: stored(db)[0] == ("right", False))
