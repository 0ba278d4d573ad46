"""The Content-Security-Policy allows nothing unsafe, and no page needs anything that it forbids (E7)."""

from __future__ import annotations

from collections.abc import Callable

import httpx2
import pytest
from playwright.sync_api import Browser

from parenting.server.db import Database
from parenting.server.runs import Claim
from tests.access import cookies
from tests.pages import island_fixtures as fixtures

WATCH = """
window.violations = [];
document.addEventListener("securitypolicyviolation", event =>
  window.violations.push(`${event.violatedDirective} ${event.blockedURI} ${event.sourceFile}`));
"""
PAGES = ("/", "/levels", "/practice", "/runs/1", "/runs/1/history", "/runs/1/parent", "/docs", "/runs/99")


@pytest.mark.parametrize("path", [*PAGES, "/healthz", "/static/site.css", "/api/v1/runs"])
def test_no_reply_allows_anything_unsafe(client: httpx2.Client, mine: Claim, path: str) -> None:
    policy = client.get(path, follow_redirects=True).headers["Content-Security-Policy"]
    assert "unsafe" not in policy
    assert "default-src 'self'" in policy
    assert "object-src 'none'" in policy


@pytest.mark.slow
def test_no_page_violates_its_policy(
    browser: Browser, address: str, db: Database, mine: Claim, ask: Callable[..., int]
) -> None:
    ask("preference")
    ask("guidance")
    fixtures.measure(db, mine, 40)
    context = browser.new_context()
    context.add_cookies(cookies(db, address))
    context.add_init_script(WATCH)
    tab = context.new_page()
    found = {}
    for path in PAGES:
        tab.goto(address + path)
        if path == "/docs":
            tab.wait_for_selector("#swagger .opblock")
            tab.locator("#swagger .opblock button").first.click()
        if path == "/runs/1":
            tab.wait_for_selector(".plot svg.main-svg", state="attached")
        tab.wait_for_load_state("networkidle") if path == "/docs" else None
        found[path] = tab.evaluate("window.violations")
    context.close()
    assert found == {path: [] for path in PAGES}
