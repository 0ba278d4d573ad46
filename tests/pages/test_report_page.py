"""The page of all experiments in a real browser: nothing of it is out of sight on a phone."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from parenting.experiments.reporting.html import report
from parenting.experiments.reporting.markdown import RESULTS
from tests.pages.axe import violated
from tests.tree import ROOT

PUBLISHED = ROOT / "docs/results"
NAMES = ("table1", "calibrate")  # long cells are in the second


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The address of a page of two published experiments."""
    out = tmp_path_factory.mktemp("results")
    for name in NAMES:
        (out / name).mkdir()
        for file in (PUBLISHED / name).iterdir():
            (out / name / file.name).symlink_to(file)
    return report(out).as_uri()


def opened(browser: Browser, address: str, width: int, scheme: str = "light") -> Page:
    page = browser.new_page(viewport={"width": width, "height": 844}, color_scheme=scheme)  # type: ignore[arg-type]
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.goto(address)
    assert said == []
    return page


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 800, 1280])
def test_every_cell_is_in_view_without_scrolling_sideways(browser: Browser, written: str, width: int) -> None:
    page = opened(browser, written, width)
    assert page.evaluate("document.documentElement.scrollWidth") == width
    cells = page.locator(".rows td:not(:empty)")
    boxes = [box for box in (cell.bounding_box() for cell in cells.all()) if box]
    assert len(boxes) == cells.count() > 2 * len(NAMES)
    assert [box for box in boxes if box["x"] < 0 or box["x"] + box["width"] > width] == []
    page.close()


@pytest.mark.slow
def test_on_a_phone_a_verdict_stands_beside_what_it_is_on(browser: Browser, written: str) -> None:
    page = opened(browser, written, 390)
    rows = page.locator(".rows:not(.measured) tbody tr")
    for row in rows.all():
        what, verdict = row.locator("th").bounding_box(), row.locator("td").last.bounding_box()
        assert what is not None
        assert verdict is not None
        assert verdict["y"] < what["y"] + what["height"]
        assert verdict["x"] >= what["x"] + what["width"]
    page.close()


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_and_figures_are_drawn(browser: Browser, written: str, scheme: str) -> None:
    page = opened(browser, written, 390, scheme)
    found = violated(page)
    assert [violation["id"] for violation in found] == []
    drawn = page.evaluate("[...document.images].map(image => image.naturalWidth)")
    assert len(drawn) == sum(len(list((PUBLISHED / name).glob("*.svg"))) for name in NAMES)
    assert all(drawn)
    page.close()


def test_links_lead_to_the_data_beside_it(browser: Browser, written: str) -> None:
    page = opened(browser, written, 1280)
    for name in NAMES:
        address = page.locator(f"#{name} a[href$='{RESULTS}']").evaluate("link => link.href")
        assert json.loads(Path(address.removeprefix("file://")).read_text())["name"] == name
    page.close()
