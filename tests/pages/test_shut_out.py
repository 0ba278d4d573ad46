"""Pages whose session has ended say so, and what was answered meanwhile is sent once somebody is in again."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from parenting.server.access import sessions, tokens
from parenting.server.access.roles import Role
from parenting.server.db import Database
from parenting.server.runs import Claim
from tests.pages.browser_tabs import BrowserTabs, given, until

STAY = "parenting.server.access.staying.SECONDS"


@pytest.fixture(autouse=True)
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(STAY, 0.2)
    monkeypatch.setattr("parenting.server.access.door.FRESH_SECONDS", 0.0)


def listening(page: Page) -> None:
    expect(page.locator("#question[data-listening]")).to_be_visible()


def test_a_parent_who_is_shut_out_is_told_and_loses_no_answer(
    tabs: BrowserTabs,
    db: Database,
    mine: Claim,
    ask: Callable[..., int],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(STAY, 3600.0)  # the answer is what meets the closed door
    tabs.expected = ("401",)
    number, link = ask(), tokens.make(db, "link", Role.PARENT, run=mine.run_id)
    page = tabs.open("/healthz")
    page.context.clear_cookies()
    page.goto(f"{tabs.address}/open?token={link.secret}")
    listening(page)
    sessions.end_all(db, Role.PARENT)
    page.keyboard.press("b")
    expect(page.locator("#saved")).to_have_text("Kept here, not sent yet")
    expect(page.get_by_role("heading", name="This page is not open to you any more.")).to_be_visible()
    page.get_by_role("link", name="How to come in").click()
    expect(page.get_by_role("heading", name="This browser is not known here")).to_be_visible()
    assert given(db) == []
    page.goto(f"{tabs.address}/open?token={link.secret}")
    until(lambda: given(db) == [(number, "right")])


@pytest.mark.slow
def test_a_parent_whose_question_waits_is_told_too_and_goes_on_when_another_tab_comes_in(
    tabs: BrowserTabs, db: Database, mine: Claim, ask: Callable[..., int]
) -> None:
    tabs.expected = ("401",)
    link = tokens.make(db, "link", Role.PARENT, run=mine.run_id)
    page = tabs.open("/healthz")
    page.context.clear_cookies()
    page.goto(f"{tabs.address}/open?token={link.secret}")
    ask()
    listening(page)
    sessions.end_all(db, Role.PARENT)
    expect(page.get_by_role("heading", name="This page is not open to you any more.")).to_be_visible()
    other = page.context.new_page()
    other.goto(f"{tabs.address}/open?token={link.secret}")
    other.close()
    listening(page)


@pytest.mark.slow
def test_a_dashboard_says_that_its_session_has_ended(tabs: BrowserTabs, db: Database, mine: Claim) -> None:
    tabs.expected = ("401",)
    page = tabs.open(f"/runs/{mine.run_id}")
    expect(page.locator(".status")).to_contain_text("The agent is exploring")
    sessions.end_all(db)
    expect(page.locator(".status")).to_contain_text("not open to this browser any more")
    page.get_by_role("link", name="How to come in").click()
    expect(page.get_by_role("heading", name="This browser is not known here")).to_be_visible()
