"""Answers that the browser keeps: with no room for them, in several tabs, and from an older version."""

from __future__ import annotations

import json
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from parenting.server.db import Database
from parenting.server.queue.answers import answer
from tests.pages.browser_tabs import BrowserTabs, given, kept, until
from tests.pages.parent_page import address, form, public_id, shown

UNSENT = "Kept here, not sent yet"
FULL = """() => {
  const error = new DOMException("full", "QuotaExceededError");
  Storage.prototype.setItem = () => { throw error; };
}"""
TOUCHED = """() => {
  window.touched = new Set();
  for (const verb of ["setItem", "removeItem"]) {
    const does = Storage.prototype[verb];
    Storage.prototype[verb] = function (...given) { window.touched.add(given[0]); does.apply(this, given); };
  }
}"""


def hinder(page: Page) -> None:
    """Let no answer of this tab reach the server."""
    page.route("**/answer", lambda route: route.abort())


def test_an_answer_is_sent_though_the_storage_is_full(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    first, second, third = ask(), ask(), ask()
    page = tabs.open(address(db))
    shown(page, first)
    page.keyboard.press("b")
    expect(page.locator("#saved")).to_have_text("Saved")  # a list of answers is there by now
    for number in (second, third):
        shown(page, number)
        page.evaluate(FULL)
        page.keyboard.press("a")
    until(lambda: given(db) == [(first, "right"), (second, "left"), (third, "left")])
    expect(page.locator("#saved")).to_have_text("Saved")


@pytest.mark.slow
def test_a_tab_touches_nothing_of_what_another_keeps(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    """Two tabs that wrote one list at the same time would lose answers."""
    number = ask()
    page = tabs.open(address(db))
    shown(page, number)
    page.evaluate(TOUCHED)
    page.keyboard.press("a")
    expect(page.locator("#saved")).to_have_text("Saved")
    names = page.evaluate("[...window.touched].filter(name => name.startsWith('parenting.answer'))")
    own = f"parenting.answer.{' '.join(form(db, number).values())}"
    assert sorted(names) == [own, "parenting.answered"]
    assert kept(page) == []


def test_answers_of_two_tabs_are_sent_in_their_order(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    tabs.expected = ("net::ERR_FAILED",)
    first, second = ask(), ask()
    page = tabs.open(address(db))
    shown(page, first)
    page.context.route("**/answer", lambda route: route.abort())
    page.keyboard.press("a")
    shown(page, second)
    other = page.context.new_page()
    other.goto(page.url)
    shown(other, second)
    other.keyboard.press("b")
    expect(other.locator("#saved")).to_have_text(UNSENT)
    assert [one["question"] for one in sorted(kept(page), key=lambda one: one["given"])] == [
        public_id(db, number) for number in (first, second)
    ]
    page.context.unroute("**/answer")
    other.evaluate("dispatchEvent(new Event('online'))")
    until(lambda: given(db) == [(first, "left"), (second, "right")])
    for tab in (page, other):
        expect(tab.locator("#saved")).to_have_text("Saved")


@pytest.mark.slow
@pytest.mark.parametrize(("refused", "says"), [(False, "Saved"), (True, "")])
def test_a_tab_hears_what_became_of_its_answer_by_another(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int], refused: bool, says: str
) -> None:
    tabs.expected = ("net::ERR_FAILED", "409")
    number = ask()
    page = tabs.open(address(db))
    shown(page, number)
    hinder(page)
    page.keyboard.press("a")
    expect(page.locator("#saved")).to_have_text(UNSENT)
    if refused:
        answer(db, number, "right", "client-of-another", "human")
    page.context.new_page().goto(page.url)
    expect(page.locator("#saved")).to_have_text(says)
    assert kept(page) == []


def test_what_the_former_version_kept_is_sent(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    """It kept one list of all answers; what belongs elsewhere stays in it."""
    number = ask()
    page = tabs.open(address(db))
    client = page.locator("#main").get_attribute("data-client")
    theirs = {"query": 7, "choice": "right", "client_id": client}
    ours = {**form(db, number), "choice": "left", "client_id": client, "given": 1}
    page.evaluate("text => localStorage.setItem('parenting.answers', text)", json.dumps([theirs, ours]))
    page.reload()
    until(lambda: given(db) == [(number, "left")])
    until(lambda: kept(page) == [theirs])
