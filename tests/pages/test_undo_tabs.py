"""Undo where several tabs of one browser answer: the last answer is that of any of them."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, Route, expect

from parenting.server.db import Database
from parenting.server.queue.answers import answer
from tests.pages.browser_tabs import BrowserTabs, until
from tests.pages.parent_page import address, shown
from tests.pages.test_undo import OTHER, stored


def two_tabs(tabs: BrowserTabs, db: Database, first: int, second: int) -> tuple[Page, Page]:
    """Two tabs of one browser: in one the first question was answered, and both show the second."""
    page = tabs.open(address(db))
    shown(page, first)
    page.keyboard.press("b")
    shown(page, second)
    until(lambda: stored(db) == [("right", True)])
    other = page.context.new_page()
    other.goto(page.url)
    shown(other, second)
    return page, other


@pytest.mark.slow
def test_the_last_answer_is_that_of_another_tab(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    first, second = ask(), ask()
    page, other = two_tabs(tabs, db, first, second)
    other.keyboard.press("a")
    expect(page.locator("#undo button")).to_contain_text("Undo: A, left")
    page.bring_to_front()
    page.keyboard.press("z")
    until(lambda: stored(db) == [("right", True), ("left", False)])
    shown(page, second)


@pytest.mark.slow
def test_an_answer_of_somebody_else_between_changes_nothing(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    """It is counted before that of the other tab is stored, and is nobody's to take back here."""
    first, second, third = ask(), ask(), ask()
    page, other = two_tabs(tabs, db, first, second)
    answer(db, third, "right", OTHER, "human")
    page.wait_for_timeout(700)  # by then the stream has told of it
    expect(page.locator("#undo button")).to_contain_text("Undo: B, down")
    other.keyboard.press("a")
    expect(page.locator("#undo button")).to_contain_text("Undo: A, left")


def hold_look(page: Page, other: Page) -> Route:
    """Let the other tab answer "left": this one looks at what came last. Its request is held back."""
    held: list[Route] = []

    def hold(route: Route) -> None:
        if held:
            route.continue_()
        else:
            held.append(route)

    page.route("**/runs/*/parent", hold)
    other.keyboard.press("a")
    while not held:
        page.wait_for_timeout(20)
    return held[0]


@pytest.mark.slow
def test_an_undo_waits_for_a_look(tabs: BrowserTabs, db: Database, ask: Callable[..., int]) -> None:
    first, second = ask(), ask()
    page, other = two_tabs(tabs, db, first, second)
    look = hold_look(page, other)
    page.keyboard.press("z")
    page.wait_for_timeout(300)
    look.continue_()
    expect(page.locator("#undo button")).to_contain_text("Undo: A, left")
    expect(page.locator("#said")).to_contain_text("Undo: A, left")  # who wants that one back says so
    assert stored(db) == [("right", True), ("left", True)]


@pytest.mark.slow
def test_an_answer_during_a_look_leaves_no_gap(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    """Also where the last answer is taken back at once: the button names the one before."""
    first, second, third = ask(), ask(), ask()
    page, other = two_tabs(tabs, db, first, second)
    look = hold_look(page, other)
    shown(page, third)
    page.keyboard.press("e")
    expect(page.locator("#saved")).to_have_text("Saved")
    look.continue_()
    page.keyboard.press("z")
    until(lambda: stored(db) == [("right", True), ("left", True), ("either", False)])
    expect(page.locator("#undo button")).to_contain_text("Undo: A, left")


@pytest.mark.slow
def test_an_answer_whose_tab_was_closed_before_the_reply_is_the_last(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    first, second = ask(), ask()
    page, other = two_tabs(tabs, db, first, second)

    def lose(route: Route) -> None:
        route.fetch()  # the reply goes no further

    other.route("**/answer", lose)
    with other.expect_request("**/answer"):
        other.keyboard.press("a")
    until(lambda: len(stored(db)) == 2)
    other.close()
    page.keyboard.press("z")
    expect(page.locator("#undo button")).to_contain_text("Undo: A, left")
    assert stored(db) == [("right", True), ("left", True)]
    page.keyboard.press("z")
    until(lambda: stored(db) == [("right", True), ("left", False)])


@pytest.mark.slow
def test_a_page_that_comes_back_looks_again(tabs: BrowserTabs, db: Database, ask: Callable[..., int]) -> None:
    """While the browser kept it for the button *Back*, it heard nothing of other tabs."""
    first, second = ask(), ask()
    page = tabs.open(address(db))
    shown(page, first)
    page.keyboard.press("b")
    expect(page.locator("#saved")).to_have_text("Saved")
    client = page.locator("#main").get_attribute("data-client") or ""
    answer(db, second, "left", client, "human")
    page.evaluate("dispatchEvent(new PageTransitionEvent('pageshow', { persisted: true }))")
    expect(page.locator("#undo button")).to_contain_text("Undo: A, left")
