"""The question after the one that is shown: fetched while somebody thinks, there at once when wanted."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import httpx2
import pytest
from fastapi import FastAPI
from playwright.sync_api import expect

from parenting.server.db import Database
from parenting.server.queue import answers
from tests.pages.browser_tabs import BrowserTabs, until
from tests.pages.parent_page import named, shown


@pytest.mark.slow
def test_a_question_that_comes_later_is_fetched_ahead_too(tabs: BrowserTabs, ask: Callable[..., int]) -> None:
    first = ask("preference", "down down", "left")
    page = tabs.open("/runs/1/parent")
    shown(page, first)
    expect(page.locator("#question")).to_have_attribute("data-ahead", "")
    second = ask("preference", "left left", "down")
    expect(page.locator("#question")).to_have_attribute("data-ahead", named(page, second))


@pytest.mark.slow
def test_guidance_goes_before_what_was_leased_ahead(tabs: BrowserTabs, ask: Callable[..., int]) -> None:
    first, second = (ask("preference", "down down", "left") for _ in range(2))
    page = tabs.open("/runs/1/parent")
    shown(page, first)
    expect(page.locator("#question")).to_have_attribute("data-ahead", named(page, second))
    urgent = ask()
    expect(page.locator("#question")).to_have_attribute("data-ahead", named(page, urgent))
    page.keyboard.press("a")
    shown(page, urgent)
    page.keyboard.press("a")
    shown(page, second)


def test_a_page_that_is_gone_is_promised_nothing(
    tabs: BrowserTabs, site: FastAPI, db: Database, ask: Callable[..., int]
) -> None:
    """Else the next question would be held for nobody, for as long as a lease is."""
    first = ask()
    page = tabs.open("/runs/1/parent")
    shown(page, first)
    until(lambda: site.state.streams.number() == 1)  # it brings the question after it, too
    page.close()  # the context alone may keep its connection for half a minute
    until(lambda: site.state.streams.number() == 0)  # Chromium's news of it may take its time
    second = ask()
    assert answers.get_query(db, second).leased_by is None


class GoneAfter:
    """A client who is there when it is asked for the first times, and then no more."""

    def __init__(self, times: int) -> None:
        self.times = times

    async def __call__(self) -> bool:
        self.times -= 1
        return self.times < 0


def test_who_waits_and_goes_is_not_looked_for_again(site: FastAPI) -> None:
    """Its patience is a minute, and nothing is found: the wait ends because it is gone."""
    looks: list[None] = []

    async def look() -> None:
        looks.append(None)

    waited = site.state.streams.wait_for(1, look, 60, GoneAfter(3))
    with ThreadPoolExecutor(1) as other_thread:  # in this one Playwright may have an event loop
        assert other_thread.submit(asyncio.run, waited).result() is None
    assert len(looks) <= 3


def test_a_question_that_was_leased_to_one_who_is_gone_is_let_go(
    client: httpx2.Client, db: Database, ask: Callable[..., int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It left while its question was looked up: the next one to come gets that at once."""
    number = ask()
    gone = GoneAfter(1)  # it is there before the look, and not after it
    monkeypatch.setattr("starlette.requests.Request.is_disconnected", lambda request: gone())
    assert client.post("/runs/1/parent/question", data={"client_id": "somebody"}).status_code == 200
    assert answers.get_query(db, number).leased_by is None
