"""The page measures each answer: when it was seen, the first reaction, by which means, on which screen."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from playwright.sync_api import Page, expect

from parenting.server.db import Database
from parenting.server.reads.answers import every
from tests.pages.browser_tabs import BrowserTabs, until
from tests.pages.parent_page import shown

HIDE = """(hidden) => {
  Object.defineProperty(document, "hidden", { configurable: true, get: () => hidden });
  document.dispatchEvent(new Event("visibilitychange"));
}"""
LEFT_FOR = 60
KEPT_FOR = 300  # ms; the page tries again after 500


def measured(db: Database, number: int) -> dict[str, Any]:
    """The measures of an answer, once it is stored."""
    until(lambda: len(list(every(db, 1))) == number)
    found = list(every(db, 1))[-1].answer.measured
    assert found is not None
    return found


def wording(page: Page) -> str | None:
    return page.locator("#question").get_attribute("data-wording")


def test_each_answer_says_when_how_and_on_which_screen(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    began, first = 1000 * time.time(), ask()
    page = tabs.open("/runs/1/parent")
    shown(page, first)
    words = wording(page)
    page.keyboard.press("a")
    one = measured(db, 1)
    assert began - 1 <= one["shown"] <= 1000 * time.time()
    assert 0 <= one["reacted"] <= one["answered"] <= 1000 * time.time() - began
    size = page.viewport_size
    assert size is not None
    assert (one["width"], one["height"]) == (size["width"], size["height"])
    assert (one["input"], one["layout"], one["sides"], one["away"]) == ("key", "one", "left-right", 0)
    assert one["wording"] == words

    tabs.expected = ("net::ERR_FAILED",)
    second = ask("preference", "left left", "down")
    shown(page, second)
    page.evaluate(HIDE, True)
    page.wait_for_timeout(LEFT_FOR)
    page.evaluate(HIDE, False)
    page.route("**/answer", lambda route: route.abort())
    page.locator(".answers [value=right]").click()
    expect(page.locator("#saved")).to_have_text("Kept here, not sent yet")
    page.unroute("**/answer")
    two = measured(db, 2)
    assert (two["input"], two["layout"], two["sides"]) == ("click", "two", "left-right")
    assert LEFT_FOR - 5 <= two["away"] <= two["answered"]
    assert two["queued"] >= KEPT_FOR
    assert one["shown"] + one["answered"] <= two["shown"] + 1
