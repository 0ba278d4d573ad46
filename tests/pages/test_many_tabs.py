"""Tabs of one browser: streams leave connections for pages and answers, and every tab stays up to date."""

from collections.abc import Callable

import pytest
from fastapi import FastAPI
from playwright.sync_api import expect

from parenting.server.db import Database
from parenting.server.progress import report_progress
from parenting.server.runs import Claim
from tests.lengths import length
from tests.pages.browser_tabs import BrowserTabs, given, until
from tests.pages.parent_page import shown
from tests.pages.traffic import opened, seen

WINDOWS = length(3, 6)
LYING = 3
"""Requests that may lie at the server: one stream of the parent's pages and two of pages that only look. A
browser has six connections, so an answer finds a free one at once, however many windows are open."""


@pytest.mark.slow
@pytest.mark.faults
@pytest.mark.torture
def test_parents_windows_and_dashboards_of_one_browser_leave_connections_for_answers(
    tabs: BrowserTabs, site: FastAPI, db: Database, mine: Claim, ask: Callable[..., int]
) -> None:
    """It takes long because many pages load, and a free stream is noticed within three seconds."""
    number = ask()
    paths = ["/runs/1"] * WINDOWS + ["/runs/1/parent"] * WINDOWS
    pages, traffic = opened(tabs, paths)
    dashboards, parent = pages[:WINDOWS], pages[-1]
    seen(parent, lambda: traffic.lying() == sorted(["events"] * 2 + ["stream"]))
    shown(parent, number)
    parent.keyboard.press("a")
    until(lambda: bool(given(db)))
    seen(parent, lambda: len(traffic.lying()) == LYING)
    report_progress(db, mine, tick=4321)
    for page in dashboards:
        expect(page.locator("#now-tick")).to_have_text("4,321")
    dashboards[0].close()
    seen(parent, lambda: traffic.lying() == sorted(["events"] * 2 + ["stream"]))
