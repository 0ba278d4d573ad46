"""The board is a grid that arrow keys explore while the focus is in it; it is left by Escape."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from parenting.envs import registry
from parenting.server.db import Database
from parenting.server.queue import worker_side
from tests.drawing.world_clips import guidance, preference
from tests.pages import island_fixtures as fixtures
from tests.pages.accessibility_tree import cells, tree
from tests.pages.browser_tabs import BrowserTabs, given, until
from tests.pages.test_access import violations
from tests.pages.test_every_world_page import posted
from tests.told_grid import read_grid

AGENT = "Agent on land."


def here(page: Page) -> str:
    """The words of the cell that has the focus; "" if none has."""
    script = "document.activeElement.matches('[role=gridcell]') ? document.activeElement.textContent : ''"
    words: str = page.evaluate(script)
    return words


def listening(page: Page) -> None:
    """Wait until the page takes keys: it begins a moment after its question is painted."""
    expect(page.locator("#question[data-listening]")).to_be_visible()


def press(page: Page, *keys: str) -> None:
    for key in keys:
        page.keyboard.press(key)


def test_arrows_explore_the_grid_and_answer_outside_of_it(tabs: BrowserTabs, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    world = registry.make("unsafe-exploration")
    for tick in (1, 2):
        worker_side.post_query(db, mine, tick, "guidance", 1, guidance(world, "d", "u"))
    page = tabs.open("/runs/1/parent?query=1")
    listening(page)
    page.locator(".answers [value=either]").focus()
    press(page, "g")
    until(lambda: here(page).startswith(AGENT))
    assert read_grid(cells(tree(page))).choice("guidance") == "left"
    assert violations(page) == []
    press(page, "ArrowDown")
    assert here(page) == "Land. A leads here."
    press(page, "End", "ArrowRight")
    assert here(page) == "Water."
    press(page, "Control+Home", "ArrowUp", "ArrowLeft")
    assert page.locator("[role=gridcell]").first.evaluate("cell => cell === document.activeElement")
    press(page, "Escape")
    expect(page.locator(".answers [value=either]")).to_be_focused()
    press(page, "g")
    until(lambda: here(page) != "")
    assert given(db) == []
    first = page.locator("#question").get_attribute("data-query")
    press(page, "a")  # letters answer in the grid, too; it goes on with the next question, at the agent
    expect(page.locator(f'#question[data-query="{first}"]')).to_have_count(0)
    until(lambda: here(page).startswith(AGENT))
    press(page, "Escape", "ArrowUp")
    until(lambda: given(db) == [(1, "left"), (2, "right")])


@pytest.mark.slow
def test_clips_are_explored_step_by_step(tabs: BrowserTabs, db: Database) -> None:
    clips = preference(registry.make("side-effects"), "dlu", "ldr")
    page = tabs.open(posted(db, "side-effects", "preference", clips, 3))
    listening(page)
    page.locator("[data-explore]").focus()
    press(page, "Enter")
    grid = page.get_by_role("grid")
    expect(grid).to_have_attribute("aria-label", "The board at step 0 of 3")
    until(lambda: here(page).startswith(AGENT))
    press(page, ".")
    expect(grid).to_have_attribute("aria-label", "The board at step 1 of 3")
    until(lambda: here(page).startswith("Land."))
    words = " ".join(page.locator("[role=gridcell]").all_text_contents())
    assert "Left: agent on land. Right: " in words
    expect(page.locator(".steps output")).to_have_text("Step 1 of 3")
    press(page, ",", ",")
    expect(grid).to_have_attribute("aria-label", "The board at step 0 of 3")
    assert given(db) == []


@pytest.mark.slow
def test_help_tells_of_the_grid_and_its_letter_can_be_switched_off(
    tabs: BrowserTabs, ask: Callable[..., int]
) -> None:
    ask()
    page = tabs.open("/runs/1/parent")
    listening(page)
    press(page, "?")
    expect(page.get_by_text("explore the board: there the arrow keys go from cell to cell")).to_be_visible()
    page.get_by_label("Letters and digits").uncheck()
    press(page, "Escape", "g")
    page.wait_for_timeout(200)
    expect(page.get_by_role("grid")).to_have_count(0)
    page.get_by_role("button", name="Explore the board").click()
    until(lambda: here(page).startswith(AGENT))


@pytest.mark.slow
@pytest.mark.parametrize("part", [".answers [value=neither]", ".around summary"])
def test_the_focus_stays_where_it_was_left(tabs: BrowserTabs, ask: Callable[..., int], part: str) -> None:
    """Also over the page that waits, and what was opened stays open."""
    ask()
    page = tabs.open("/runs/1/parent")
    listening(page)
    page.locator(".around summary").click()
    page.locator(part).focus()
    press(page, "b")
    expect(page.locator("#waiting")).to_be_visible()
    ask()
    expect(page.locator("#question")).to_be_visible()
    expect(page.locator(part)).to_be_focused()
    expect(page.locator(".around")).to_have_attribute("open", "")


@pytest.mark.slow
def test_an_error_takes_the_focus(tabs: BrowserTabs, ask: Callable[..., int]) -> None:
    tabs.expected = ("409",)
    ask()
    page = tabs.open("/runs/1/parent")
    listening(page)
    body = '{"error": {"code": "conflict", "message": "Somebody else was first."}}'
    page.route("**/answer", lambda route: route.fulfill(status=409, json=None, body=body))
    page.locator(".answers [value=left]").focus()
    press(page, "a")
    expect(page.get_by_text("Somebody else was first.")).to_be_focused()


def test_an_error_page_begins_at_its_heading(tabs: BrowserTabs) -> None:
    tabs.expected = ("404",)
    page = tabs.open("/runs/9/parent")
    expect(page.get_by_role("heading", name="That did not work")).to_be_focused()
