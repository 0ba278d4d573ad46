"""A person answers thirty questions by keyboard in every world, at T = 1 and in stages up to T = 2, through
real processes, while a dashboard moves.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Browser, Page, expect

from parenting.envs import registry
from tests.pages.browser_tabs import BrowserTabs
from tests.simulated_person import create, until, up

QUESTIONS = 30
STAGES = {
    1: {},
    2: {"stages": 2, "mature_every": 12, "p_guid": 0.8},  # clips of two steps have to come about, too
}
RUNS = [(world, stage) for world in registry.WORLDS for stage in STAGES]


def key(page: Page, number: int) -> str:
    """What this person presses: never for what is dangerous, else in turn."""
    left, right = (card.locator(".bad").count() > 0 for card in page.locator(".card").all())
    if left and right:
        return "ArrowDown"
    if left or right:
        return "ArrowRight" if left else "ArrowLeft"
    return ("ArrowLeft", "ArrowRight", "ArrowUp")[number % 3]


def answer(page: Page, number: int) -> str:
    """Wait for a question, press the key, wait until the page has moved on: the kind of the question.

    Who has refused all four moves ends the episode first.
    """
    page.locator("#question:visible, button:visible:text('End this episode')").first.wait_for()
    if page.get_by_role("button", name="End this episode").is_visible():
        page.get_by_role("button", name="End this episode").click()
    form = page.locator("#question")
    query, kind = form.get_attribute("data-query"), form.get_attribute("data-kind")
    page.keyboard.press(key(page, number))
    page.wait_for_selector(f'#question[data-query="{query}"]', state="detached")
    return str(kind)


def raised(tabs: BrowserTabs, world: str, stage: int) -> dict[str, Any]:
    """A run with thirty answers by keyboard: what the API says of it."""
    run = create(tabs.address, world=world, config=STAGES[stage], goal=QUESTIONS, seed=5)
    dashboard = tabs.open(f"/runs/{run}")
    page = tabs.open(f"/runs/{run}/parent")
    page.set_default_timeout(30_000)
    seen = {"tick": set[str](), "answered": set[str]()}
    for number in range(QUESTIONS):
        answer(page, number)
        for name, numbers in seen.items():
            numbers.add(dashboard.locator(f"#now-{name}").inner_text())
    assert len(seen["answered"]) > 3, seen  # it moved meanwhile
    assert len(seen["tick"]) > 1, seen  # told with what is measured, which in the garden is now and then
    expect(page.get_by_role("heading", name="That was the last question of this goal.")).to_be_visible()
    expect(dashboard.locator("#now-answered")).to_have_text(str(QUESTIONS))
    expect(dashboard.get_by_role("status")).to_contain_text("The goal of 30 questions is reached.")
    expect(dashboard.locator("#now-maturity")).to_have_text(str(stage))
    expect(dashboard.locator(".js-plotly-plot").first).to_be_visible()
    told: dict[str, Any] = httpx2.get(f"{tabs.address}/api/v1/runs/{run}").json()
    page.context.close()
    dashboard.context.close()
    return told


@pytest.mark.timeout(600)
def test_thirty_answers_in_every_world_and_stage(browser: Browser, tmp_path: Path) -> None:
    with up(tmp_path) as url:
        tabs = BrowserTabs(browser, url)
        for world, stage in RUNS:
            run = raised(tabs, world, stage)
            assert (run["answers"], run["maturity"], run["resting"]) == (QUESTIONS, stage, True), world
            assert run["status"] == "active"
        tabs.close()
        assert tabs.wrong == []
        until(lambda: httpx2.get(f"{url}/readyz").status_code == 200, 5, "the worker is gone")
