"""The first page while it is open: the list follows its runs, the form tells the cost of a level."""

from __future__ import annotations

import re

import httpx2
import pytest
from playwright.sync_api import expect

from parenting.server.db import Database
from parenting.server.progress import report_progress
from parenting.server.runs import set_status
from parenting.server.statuses import RunStatus
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs


@pytest.mark.slow
def test_the_list_follows_its_runs_and_the_form_tells_the_cost_while_it_is_typed(
    tabs: BrowserTabs, db: Database
) -> None:
    _, mine = fixtures.start_run(db)
    fixtures.start_run(db)
    page = tabs.open("/")
    row = page.locator("li[data-run='1']")
    row.get_by_role("checkbox").check()
    row.get_by_role("link", name="Dashboard").focus()
    rows = ["W" * 62, "WA" + " " * 58 + "GW", *["W" + " " * 60 + "W"] * 59, "W" * 62]
    page.evaluate(
        "text => { own = document.getElementById('level_text'); own.value = text; "
        "own.dispatchEvent(new Event('input')); }",
        "\n".join(rows),
    )
    expect(page.locator("#level_text-told")).to_contain_text("On this level a tick takes")
    report_progress(db, mine, tick=1234)
    fixtures.start_run(db)
    expect(row.locator(".numbers")).to_contain_text("1,234")
    expect(page.locator("li[data-run='3']")).to_be_visible()
    expect(row.get_by_role("checkbox")).to_be_checked()
    for number in (1, 2, 3):
        set_status(db, number, RunStatus.STOPPED)
    expect(page.locator("ul.runs li.run:not(.over)")).to_have_count(0)
    expect(row.get_by_role("checkbox")).to_be_checked()


def test_the_rows_of_a_later_page_are_asked_for_at_its_address(client: httpx2.Client, db: Database) -> None:
    fixtures.start_run(db)
    told = r'<ul class="runs" data-address="([^"]*)"'
    assert re.findall(told, client.get("/?q=Run").text) == ["/?q=Run"]
    assert re.findall(told, client.get("/?before=9&sort=oldest").text) == ["/?sort=oldest&amp;before=9"]
    assert re.findall(told, client.get("/").text) == ["/"]
