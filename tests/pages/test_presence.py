"""Presence on the page: what is left comes to who waits, and a question can be taken over."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Request, expect

from parenting.server.db import Database
from parenting.server.queue.presence import GRACE_SECONDS, held, holder
from parenting.server.settings import Settings
from tests.pages.browser_tabs import BrowserTabs, given, until
from tests.pages.parent_page import named, shown

ELSEWHERE = "Somebody else has the question."


@pytest.mark.slow
def test_a_question_is_taken_over_and_the_other_page_says_so(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    number = ask()
    laptop = tabs.open("/runs/1/parent")
    shown(laptop, number)
    phone = tabs.open("/runs/1/parent")
    expect(phone.get_by_role("heading", name=ELSEWHERE)).to_be_visible()
    phone.get_by_role("button", name="Answer here instead").click()
    shown(phone, number)
    expect(laptop.get_by_role("heading", name="Your question was taken over.")).to_be_visible()
    laptop.get_by_role("button", name="Answer here instead").click()
    shown(laptop, number)
    expect(phone.get_by_role("heading", name="Your question was taken over.")).to_be_visible()
    plain = tabs.open("/runs/1/parent", java_script_enabled=False)
    plain.get_by_role("button", name="Answer here instead").click()
    expect(plain.locator(f'#question[data-query="{named(plain, number)}"]')).to_be_visible()
    expect(laptop.get_by_role("heading", name="Your question was taken over.")).to_be_visible()
    plain.get_by_role("group", name="Your answer").get_by_role("button", name="Left").click()
    until(lambda: given(db) == [(number, "left")])
    expect(laptop.get_by_role("heading", name="The agent is exploring")).to_be_visible()


@pytest.mark.slow
@pytest.mark.faults
def test_a_question_comes_to_who_waits_once_the_last_tab_that_shows_it_is_left(
    tabs: BrowserTabs, ask: Callable[..., int]
) -> None:
    """It lasts for two graces: one in which another tab of the same person keeps the question."""
    number = ask()
    first = tabs.open("/runs/1/parent")
    shown(first, number)
    second = first.context.new_page()
    second.goto(f"{tabs.address}/runs/1/parent")
    shown(second, number)
    waiting = tabs.open("/runs/1/parent")
    heading = waiting.get_by_role("heading", name=ELSEWHERE)
    expect(heading).to_be_visible()
    first.goto("about:blank")
    waiting.wait_for_timeout(1000 * (GRACE_SECONDS + 1))
    expect(heading).to_be_visible()
    second.goto("about:blank")
    shown(waiting, number)


def test_a_page_that_nobody_looks_at_holds_its_question_no_longer(
    settings: Settings, tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    number = ask()
    page = tabs.open("/")
    page.clock.install()
    page.goto(f"{tabs.address}/runs/1/parent")
    shown(page, number)
    client = page.locator("#main").get_attribute("data-client") or ""
    sent: list[Any] = []

    def noted(request: Request) -> None:
        if request.url.endswith("/renew"):
            sent.append(request.post_data_json)

    page.on("request", noted)
    page.clock.fast_forward(int(1000 * (settings.attention_seconds + 30)))
    while not any(body["idle"] > settings.attention_seconds for body in sent):
        page.wait_for_timeout(50)
    count = len(sent)
    shown(page, number)
    page.mouse.move(50, 50)
    while len(sent) == count:
        page.wait_for_timeout(50)
    assert sent[-1]["idle"] < 1
    assert [lease["holder"] for lease in held(db, 1).leases] == [holder(client)]
