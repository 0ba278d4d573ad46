"""The API's page: Swagger UI offline, on our own description; without JavaScript, a list of the routes."""

import httpx2
import pytest
from playwright.sync_api import expect

from parenting.server.db import Database
from tests.pages import island_fixtures as fixtures
from tests.pages.axe import violated
from tests.pages.browser_tabs import BrowserTabs
from tests.pages.test_access import SCREENS


def routes(client: httpx2.Client) -> list[tuple[str, str]]:
    paths = client.get("/api/v1/openapi.json").json()["paths"]
    return [(method.upper(), path) for path, methods in paths.items() for method in methods]


@pytest.mark.slow
def test_without_javascript_every_route_is_listed(client: httpx2.Client) -> None:
    text = client.get("/docs").text
    assert routes(client)
    missing = [name for name in routes(client) if f"<code><b>{name[0]}</b> {name[1]}</code>" not in text]
    assert missing == []
    assert 'href="/api/v1/openapi.json"' in text


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("screen", SCREENS)
def test_every_route_is_shown(tabs: BrowserTabs, client: httpx2.Client, screen: str, scheme: str) -> None:
    page = tabs.open("/docs", viewport=SCREENS[screen], color_scheme=scheme)
    expect(page.locator(".opblock")).to_have_count(len(routes(client)))
    assert page.evaluate("document.documentElement.scrollWidth") == SCREENS[screen]["width"]
    assert page.evaluate("document.documentElement.classList.contains('dark-mode')") == (scheme == "dark")
    expect(page.locator("#operations")).to_have_attribute("role", "group")
    found = {rule["id"] for rule in violated(page)}
    # Swagger UI's own: a button to copy a path stands within another; and its `main` cannot be another tag.
    assert found <= {"nested-interactive", "aria-allowed-role"}


@pytest.mark.slow
def test_a_route_can_be_tried_out(tabs: BrowserTabs, db: Database) -> None:
    fixtures.start_run(db)
    page = tabs.open("/docs")
    route = page.locator("#operations-runs-get_run")
    route.locator(".opblock-summary-control").click()
    expect(route.get_by_placeholder("run_id")).to_have_value("1")
    route.get_by_role("button", name="Execute").click()
    expect(route.locator(".live-responses-table .response-col_status").last).to_contain_text("200")
    expect(route.locator(".live-responses-table")).to_contain_text('"world": "unsafe-exploration"')
