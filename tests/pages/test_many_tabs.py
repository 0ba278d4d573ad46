"""Tabs of one browser: streams leave connections for pages and answers, and every tab stays up to date."""

from collections.abc import Callable

from fastapi import FastAPI
from playwright.sync_api import expect

from parenting.server import runs
from parenting.server.db import Database
from parenting.server.runs import Claim
from tests.pages.browser_tabs import BrowserTabs, given, until
from tests.pages.parent_page import shown


def test_seven_dashboards_beside_the_parents_page_hold_nothing_up(
    tabs: BrowserTabs, site: FastAPI, db: Database, mine: Claim, ask: Callable[..., int]
) -> None:
    """It takes long because eight pages load, and a free stream is noticed within three seconds."""
    number = ask()
    first = tabs.open("/runs/1")
    opened = [first, *(first.context.new_page() for _ in range(6))]
    for page in opened[1:]:
        page.goto(f"{tabs.address}/runs/1")
    until(lambda: site.state.streams.number() == 3)
    parent = first.context.new_page()
    parent.goto(f"{tabs.address}/runs/1/parent")
    shown(parent, number)
    parent.keyboard.press("a")
    until(lambda: bool(given(db)))
    assert site.state.streams.number() == 3
    runs.report_progress(db, mine, tick=4321)
    for page in opened:
        expect(page.locator("#now-tick")).to_have_text("4321")
    first.close()
    until(lambda: site.state.streams.number() == 2)
    until(lambda: site.state.streams.number() == 3)
