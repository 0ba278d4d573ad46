"""The first page of a new installation: one picture and one button above the form."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import expect

from parenting.server.db import Database
from parenting.server.runs import get_run
from tests.pages.browser_tabs import BrowserTabs
from tests.pages.parent_page import address
from tests.pages.test_access import violations

SIZES = {1280: 800, 390: 844, 320: 640}
BUTTON = "Raise your first agent"


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", SIZES)
def test_picture_and_button_are_seen_at_once_on_every_screen(
    tabs: BrowserTabs, width: int, scheme: str
) -> None:
    page = tabs.open("/", viewport={"width": width, "height": SIZES[width]}, color_scheme=scheme)
    picture, button = page.locator(".welcome img"), page.get_by_role("button", name=BUTTON)
    expect(picture).to_be_in_viewport(ratio=1)
    expect(button).to_be_in_viewport(ratio=1)
    assert picture.evaluate("image => image.decode().then(() => image.naturalWidth)") > 0
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert violations(page) == []
    above, below = button.bounding_box(), page.get_by_role("button", name="Start", exact=True).bounding_box()
    assert above is not None
    assert below is not None
    assert above["y"] < below["y"]


def test_the_button_starts_the_default_run_without_javascript(tabs: BrowserTabs, db: Database) -> None:
    page = tabs.open("/", java_script_enabled=False)
    page.get_by_role("button", name=BUTTON).click()
    expect(page).to_have_url(tabs.address + address(db))
    assert (get_run(db, 1).parent, get_run(db, 1).preset) == ("human", "frugal")


@pytest.mark.slow
def test_the_picture_stands_still_where_motion_is_unwanted(tabs: BrowserTabs) -> None:
    source = "image => image.currentSrc"
    still = tabs.open("/", reduced_motion="reduce").locator(".welcome img")
    moving = tabs.open("/", reduced_motion="no-preference").locator(".welcome img")
    assert re.fullmatch(r".*/query(\.\w+)?\.svg", still.evaluate(source))
    assert re.fullmatch(r".*/question(\.\w+)?\.svg", moving.evaluate(source))
