"""Every verb by plain forms: a person without JavaScript raises an agent, from its start to its end."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from parenting.server.db import Database, connect
from parenting.server.operator_events import list_operator_events
from parenting.server.runs import get_run
from parenting.server.settings import Settings
from parenting.server.worker import Worker
from tests.pages.browser_tabs import BrowserTabs
from tests.pages.parent_page import address
from tests.simulated_person import until


@pytest.fixture
def worker(db: Database, settings: Settings) -> Iterator[Worker]:
    """A worker that raises the runs of this database meanwhile."""
    own = connect(settings)
    worker = Worker(own, settings)
    thread = threading.Thread(target=worker.work)
    thread.start()
    yield worker
    worker.stop()
    thread.join()
    own.close()


def press(page: Page, name: str | re.Pattern[str]) -> None:
    page.get_by_role("button", name=name, exact=True).first.click()


def answer(page: Page, choice: str) -> None:
    """One question, from the button that shows it to the page after it."""
    show = page.get_by_role("button", name="Show the question")
    if not page.locator("#question").is_visible():
        show.wait_for()  # the page that waits reloads by itself
        show.click()
    page.locator(f".answers [value={choice}]").click()


@pytest.mark.slow
@pytest.mark.faults
@pytest.mark.timeout(300)
def test_from_start_to_stop(tabs: BrowserTabs, db: Database, worker: Worker) -> None:
    tabs.expected = ("422",)
    page = tabs.open("/", java_script_enabled=False)
    page.get_by_label("Level", exact=True).select_option("island")
    page.get_by_label("Conservative").check()
    page.get_by_text("More settings").click()
    page.get_by_label("Stages").fill("two")
    page.get_by_label("Goal").fill("5")
    press(page, "Start")
    expect(page.locator("[id='config.stages-error']")).to_contain_text("a whole number from 1 to 16")
    page.get_by_label("Stages").fill("2")
    press(page, "Start")
    expect(page).to_have_url(tabs.address + address(db))
    for choice in ("left", "right", "either"):
        answer(page, choice)
    expect(page.locator("#count")).to_have_text("3")
    expect(page.locator("#goal")).to_have_text("of 5")

    page.get_by_role("link", name="Dashboard").click()
    press(page, "Pause")
    expect(page.get_by_role("status")).to_contain_text("The run is paused.")
    tick = get_run(db, 1).tick
    press(page, "Resume")
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    press(page, "Mature now")
    expect(page.locator("#events")).to_contain_text("Ended the stage")
    page.get_by_label("p_guid", exact=True).fill("1.5")
    press(page, "Change")
    expect(page.locator("#p_guid-error")).to_be_visible()
    page.get_by_label("p_guid", exact=True).fill("1")
    press(page, "Change")
    page.get_by_role("link", name="Answer questions").click()
    answer(page, "left")
    answer(page, "right")
    expect(page.get_by_role("heading", name="That was the last question of this goal.")).to_be_visible()
    press(page, "50 more")
    expect(page.locator("#goal")).to_have_text("of 55")
    until(
        lambda: all(row.applied_tick for row in list_operator_events(db, 1)), 10, "an event was not applied"
    )
    assert [row.kind for row in list_operator_events(db, 1)] == ["mature", "change"]
    assert get_run(db, 1).tick >= tick

    page.get_by_role("link", name="Dashboard").click()
    expect(page.locator("#now-maturity")).to_have_text("2")
    expect(page.get_by_role("button", name="Mature now")).to_have_count(0)
    press(page, "5 a second")
    expect(page.get_by_text("of 5", exact=True)).to_be_visible()
    page.get_by_label("Goal, in answers").fill("20")
    page.locator("form:has(#goal)").get_by_role("button").click()
    expect(page.get_by_text("of 20", exact=True)).to_be_visible()
    press(page, "End the episode")
    expect(page.locator("#events")).to_contain_text("Ended the episode")

    page.get_by_role("link", name="History").click()
    expect(page.locator(".entry")).to_have_count(5)
    expect(page.locator(".entry h2").last).to_have_text(re.compile("1 A, (up|down|left|right), is better"))
    page.get_by_label("Answer").select_option("either")
    press(page, "Show")
    expect(page.locator(".entry")).to_have_count(1)
    page.get_by_role("link", name="Dashboard").click()
    page.get_by_role("link", name="End this run…").click()
    press(page, "End this run")
    expect(page.get_by_role("status")).to_contain_text("Stopped by the operator.")
    assert get_run(db, 1).status == "stopped"
    page.get_by_role("link", name="Parenting").click()
    expect(page.locator(".run .chip")).to_have_text("stopped")
