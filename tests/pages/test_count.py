"""The number of answers that stand, above the question, whatever comes first: the reply or the stream."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest
from playwright.sync_api import Route, expect

from parenting.server.db import Database
from parenting.server.settings import Settings
from tests.pages.browser_tabs import BrowserTabs
from tests.pages.parent_page import address

LATE = 1.5
"""Seconds by which the reply to a skip is late, so that the stream tells of it first."""


@pytest.mark.slow
def test_a_skip_that_the_stream_tells_first_is_taken_off_once(
    settings: Settings, tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    ask("preference")
    ask("preference")
    page = tabs.open(address(db), viewport={"width": 390, "height": 844})

    def late(route: Route) -> None:
        reply = route.fetch()
        time.sleep(LATE)
        route.fulfill(response=reply)

    page.wait_for_selector("#question[data-listening]")
    page.keyboard.press("e")
    expect(page.locator("#count")).to_have_text("1")
    page.route("**/skip", late)
    page.wait_for_selector("#question[data-listening]")
    skip, title = page.locator(".cannot").bounding_box(), page.locator("#question h1").bounding_box()
    assert skip is not None
    assert title is not None
    assert skip["y"] >= title["y"] + title["height"], "the button covers no word of the title on a phone"
    with page.expect_response("**/skip"):
        page.keyboard.press("s")
    page.wait_for_timeout(500)  # the reply is told together with what the page shows next
    expect(page.locator("#saved")).to_have_text("Saved")
    expect(page.locator("#count")).to_have_text("1")


@pytest.mark.slow
def test_a_part_of_the_page_that_does_not_come_is_asked_for_at_the_next_answer(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    """A page that is left while it loads one is not at fault either."""
    ask(), ask()
    tabs.expected = ("net::ERR_FAILED",)
    page = tabs.open(address(db))
    reported: list[str] = []
    page.on("request", lambda request: reported.extend([request.url] if "page-errors" in request.url else []))
    page.route("**/static/parent-growth.*.js", lambda route: route.abort(), times=1)
    page.wait_for_selector("#question[data-listening]")
    with page.expect_event("requestfailed"):
        page.keyboard.press("e")
    page.wait_for_selector("#question[data-listening]")
    with page.expect_response("**/static/parent-growth.*.js"):
        page.keyboard.press("e")
    assert reported == []
