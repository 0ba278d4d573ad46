"""On a touch screen the pages name what a thumb can press, and show where a table goes on."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from parenting.server.db import Database
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs

PHONE = {"width": 390, "height": 844}
TABLET = {"width": 820, "height": 1180}


@pytest.mark.parametrize(("screen", "names"), [(PHONE, ["A", "B"]), (TABLET, ["A", "B"])])
def test_on_a_touch_screen_the_help_names_the_buttons_and_no_keys(
    tabs: BrowserTabs, db: Database, screen: dict[str, int], names: list[str]
) -> None:
    _, mine = fixtures.start_run(db)
    fixtures.ask(db, mine, 1, "guidance", fixtures.guidance("left", "up", start=(1, 2)))
    page = tabs.open("/runs/1/parent?query=1", viewport=screen, has_touch=True, is_mobile=True)
    page.get_by_role("button", name="Help").click()
    expect(page.get_by_role("dialog")).to_be_visible()
    assert page.locator(".keys div:not(.turns) dt:visible").all_inner_texts() == [
        *names,
        "Either",
        "Neither",
        "I can’t tell",
    ]
    assert not [key for key in page.locator("kbd").all() if key.is_visible()]
    buttons = [text.split("\n")[0] for text in page.locator(".answers button").all_inner_texts()]
    assert buttons[:2] == names


def test_with_a_keyboard_the_help_shows_keys(tabs: BrowserTabs, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    fixtures.ask(db, mine, 1, "guidance", fixtures.guidance("left", "up", start=(1, 2)))
    page = tabs.open("/runs/1/parent?query=1", viewport={"width": 1280, "height": 800})
    page.get_by_role("button", name="Help").click()
    expect(page.get_by_role("dialog")).to_be_visible()
    keys = [" ".join(text.split()) for text in page.locator(".keys dt:visible").all_inner_texts()]
    assert keys == ["A 1", "B 2", "← → ↑ ↓", "E", "N", "S", "Space", "Z", "W", "D", "G", "?"]


@pytest.mark.slow
def test_a_table_wider_than_the_phone_has_a_shadow_where_it_goes_on(tabs: BrowserTabs, db: Database) -> None:
    _, mine = fixtures.start_run(db, config={"stages": 2})
    fixtures.measure(db, mine, 40)
    page = tabs.open("/runs/1", viewport=PHONE, has_touch=True, is_mobile=True)
    table = page.locator(".stages .scroll")
    assert "optimal return" in table.inner_text()
    image = table.evaluate("element => getComputedStyle(element).backgroundImage")
    attached = table.evaluate("element => getComputedStyle(element).backgroundAttachment")
    assert image.count("linear-gradient") == 4
    assert attached.split(", ")[:4] == ["local", "local", "scroll", "scroll"]
    cells = table.locator("tbody td").all()
    assert all(
        cell.evaluate("cell => getComputedStyle(cell).backgroundColor") == "rgba(0, 0, 0, 0)"
        for cell in cells
    )  # a cell with a ground of its own would lie over the shadow


@pytest.mark.parametrize("path", ["/runs/abc", "/runs/abc/parent", "/runs/abc/history", "/runs/0"])
def test_a_run_that_cannot_be_is_not_found(tabs: BrowserTabs, path: str) -> None:
    tabs.expected = ("404",)
    page = tabs.open(path)
    expect(page.get_by_text(f"There is no run '{path.split('/')[2]}'.")).to_be_visible()
    assert "valid integer" not in page.content()
