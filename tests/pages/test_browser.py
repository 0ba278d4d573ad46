"""The parent's page in a real browser: real keys, real rows, nothing lost, with JavaScript and without."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Route, expect

from parenting.server import runs
from parenting.server.db import Database
from parenting.server.progress import report_progress
from parenting.server.queue import answers
from parenting.server.runs import Claim
from parenting.server.statuses import RunStatus
from parenting.server.tables import Query
from tests.pages.browser_tabs import BrowserTabs, given, kept, until
from tests.pages.parent_page import address, shown


def test_keys_answer_one_question_after_another(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    keys = ["ArrowLeft", "ArrowDown", "a", "b", "1", "2", "e", "n"]
    numbers = [ask() for _ in keys]
    page = tabs.open("/runs/1/parent")
    for number, key in zip(numbers, keys, strict=True):
        shown(page, number)
        page.keyboard.press(key)
    expect(page.locator("#saved")).to_have_text("Saved")
    expect(page.locator("#count")).to_have_text("8")
    choices = ["left", "right"] * 3 + ["either", "neither"]
    assert given(db) == list(zip(numbers, choices, strict=True))


def test_arrows_cells_cards_and_buttons_answer_too(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    numbers = [ask(), ask(), ask("preference", "down down", "left"), ask("preference", "down", "left")]
    page = tabs.open("/runs/1/parent")
    shown(page, numbers[0])
    page.locator(".move.of-b .head").click()
    shown(page, numbers[1])
    page.locator(".move.of-a .target").click(position={"x": 4, "y": 4})
    shown(page, numbers[2])
    page.locator(".card").nth(1).click()
    shown(page, numbers[3])
    page.get_by_role("button", name="Neither").click()
    choices = ["right", "left", "right", "neither"]
    until(lambda: given(db) == list(zip(numbers, choices, strict=True)))


@pytest.mark.slow
def test_a_new_question_appears_by_itself(tabs: BrowserTabs, db: Database, ask: Callable[..., int]) -> None:
    page = tabs.open("/runs/1/parent")
    expect(page.get_by_role("heading", name="The agent is exploring")).to_be_visible()
    expect(page).to_have_title("The agent is exploring on its own. · Unsafe Exploration, island")
    number = ask()
    shown(page, number)
    expect(page).to_have_title("● Which move is better here? · Unsafe Exploration, island")
    expect(page.locator("#said")).to_contain_text("A, left: into the water. B, down: onto land.")
    page.keyboard.press("b")
    expect(page.get_by_role("heading", name="The agent is exploring")).to_be_visible()
    assert given(db) == [(number, "right")]


@pytest.mark.slow
def test_it_works_where_no_stream_comes_through(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    tabs.expected = ("net::ERR_FAILED",)
    page = tabs.open("/")
    page.context.route("**/events*", lambda route: route.abort())
    page.goto(f"{tabs.address}/runs/1/parent")
    expect(page.get_by_role("heading", name="The agent is exploring")).to_be_visible()
    numbers = []
    for _ in range(2):
        numbers.append(ask())
        shown(page, numbers[-1])
        page.keyboard.press("b")
    until(lambda: given(db) == [(number, "right") for number in numbers])


def test_an_answer_given_offline_is_kept_and_sent(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    tabs.expected = ("net::ERR_INTERNET_DISCONNECTED",)
    number = ask()
    page = tabs.open("/runs/1/parent")
    shown(page, number)
    page.context.set_offline(True)
    page.keyboard.press("b")
    expect(page.locator("#saved")).to_have_text("Kept here, not sent yet")
    expect(page.get_by_role("heading", name="No connection")).to_be_visible()
    assert given(db) == []
    page.context.set_offline(False)
    expect(page.locator("#saved")).to_have_text("Saved")
    assert given(db) == [(number, "right")]


def test_an_answer_survives_a_closed_tab(tabs: BrowserTabs, db: Database, ask: Callable[..., int]) -> None:
    tabs.expected = ("503",)
    number = ask()
    page = tabs.open("/runs/1/parent")
    shown(page, number)

    def busy(route: Route) -> None:
        route.fulfill(status=503, json={"error": {"code": "busy", "message": "busy"}})

    page.context.route("**/answer", busy)
    page.keyboard.press("n")
    expect(page.locator("#saved")).to_have_text("Kept here, not sent yet")
    expect(page.locator("#waiting-unsent")).to_be_visible()  # nobody else has the question
    page.close()
    page.context.unroute("**/answer")
    again = page.context.new_page()
    again.goto(f"{tabs.address}/runs/1/parent")
    until(lambda: given(db) == [(number, "neither")])
    until(lambda: kept(again) == [])


def test_a_lost_reply_is_asked_for_again(tabs: BrowserTabs, db: Database, ask: Callable[..., int]) -> None:
    """The server stored the answer and the reply got lost: the same again is the same answer."""
    tabs.expected = ("net::ERR_FAILED",)
    number = ask()
    page = tabs.open("/runs/1/parent")
    shown(page, number)
    lost: list[int] = []

    def lose(route: Route) -> None:
        if not lost:
            lost.append(route.fetch().status)
            route.abort()
        else:
            route.continue_()

    page.context.route("**/answer", lose)
    page.keyboard.press("b")
    expect(page.locator("#saved")).to_have_text("Saved")
    expect(page.locator("#count")).to_have_text("1")
    assert lost == [200]
    assert given(db) == [(number, "right")]


def test_a_question_closed_by_another_is_told(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    tabs.expected = ("409",)
    number, following = ask(), ask()
    page = tabs.open("/runs/1/parent")
    shown(page, number)
    answers.answer(db, number, "left", "somebody", "human")
    page.keyboard.press("b")
    expect(page.get_by_role("alert")).to_contain_text("already answered by someone else")
    expect(page.locator("#saved")).to_have_text("")
    shown(page, following)
    assert given(db) == [(number, "left")]


@pytest.mark.slow
def test_a_key_held_down_answers_once(tabs: BrowserTabs, db: Database, ask: Callable[..., int]) -> None:
    first, second = ask(), ask()
    page = tabs.open("/runs/1/parent")
    shown(page, first)
    page.keyboard.down("b")
    page.keyboard.down("b")  # Chromium sends this one as a repeat
    shown(page, second)
    page.keyboard.up("b")
    page.locator(".answers [value=right]").focus()
    page.keyboard.down("Control")
    page.keyboard.press("a")
    page.keyboard.up("Control")
    page.keyboard.press("e")
    until(lambda: given(db) == [(first, "right"), (second, "either")])


def test_help_opens_and_takes_the_keys(tabs: BrowserTabs, db: Database, ask: Callable[..., int]) -> None:
    number = ask()
    page = tabs.open("/runs/1/parent")
    shown(page, number)
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_be_visible()
    page.keyboard.press("a")
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).not_to_be_visible()
    expect(page.locator("dialog :focus")).to_have_count(0)  # Chromium moves it with the next picture
    assert given(db) == []
    page.keyboard.press("a")
    until(lambda: given(db) == [(number, "left")])


def test_it_works_without_javascript(tabs: BrowserTabs, db: Database, ask: Callable[..., int]) -> None:
    numbers = [ask(), ask("preference", "down down", "left")]
    page = tabs.open("/runs/1/parent", java_script_enabled=False)
    page.get_by_role("button", name="Show the question").click()
    expect(page.locator("svg.board .trail")).to_have_count(2)
    page.get_by_role("button", name="Either equally good").click()
    expect(page).to_have_url(tabs.address + address(db, query=numbers[1]))
    page.locator(".card").first.click()
    expect(page.get_by_role("heading", name="The agent is exploring")).to_be_visible()
    assert given(db) == [(numbers[0], "either"), (numbers[1], "left")]


@pytest.mark.slow
def test_who_waits_is_told_as_it_changes(tabs: BrowserTabs, db: Database, mine: Claim) -> None:
    page = tabs.open("/runs/1/parent")
    expect(page.get_by_role("heading", name="exploring on its own")).to_be_visible()
    report_progress(db, mine, waiting="stuck", optimal=True)
    expect(page.get_by_role("heading", name="No action was acceptable")).to_be_visible()
    optimal = page.get_by_text("The agent has found the optimal way.")
    expect(optimal).not_to_be_visible()  # nothing was answered yet
    page.get_by_role("button", name="End this episode").click()
    report_progress(db, mine, waiting=None)
    runs.set_status(db, 1, RunStatus.PAUSED)
    expect(page.get_by_role("heading", name="The run is paused")).to_be_visible()
    page.get_by_role("button", name="Resume").click()
    expect(page.get_by_role("heading", name="exploring on its own")).to_be_visible()
    runs.set_status(db, 1, RunStatus.STOPPED, "Stopped by the operator.")
    expect(page.get_by_role("heading", name="This run is over")).to_be_visible()


def test_a_leased_question_stays_with_its_browser(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    number = ask()
    page = tabs.open("/runs/1/parent")
    shown(page, number)
    page.reload()
    shown(page, number)
    tab = page.context.new_page()
    tab.goto(f"{tabs.address}/runs/1/parent")
    shown(tab, number)
    other = tabs.open("/runs/1/parent")
    expect(other.get_by_role("heading", name="Somebody else has the question")).to_be_visible()
    with db.read() as session:
        assert session.get_one(Query, number).leased_by
