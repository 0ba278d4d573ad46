"""A person answers questions by keyboard in every world, in stages up to T = 2, and in one of them at T = 1.

The processes are real, and a dashboard moves meanwhile. Each asks 8 questions; in `make torture` each asks
30, and every world is tried at T = 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Browser, Page, expect

from parenting.envs import registry
from tests.access import cookies_in
from tests.lengths import length
from tests.pages.browser_tabs import BrowserTabs
from tests.simulated_person import create, until, up

QUESTIONS = length(6, 30)
STAGES = {
    1: {},
    2: {
        "stages": 2,
        "mature_every": length(4, 12),
        "p_guid": 0.8,
    },  # clips of two steps have to come about, too
}


PLACES = [(world, 2) for world in length(["side-effects", "reward-hacking"], list(registry.WORLDS))] + [
    (world, 1) for world in length(["unsafe-exploration"], list(registry.WORLDS))
]
"""Worlds and last stages; what comes to have two stages begins at T = 1."""


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Any]]:
    """`parenting up` with a database of its own: its URL, and the cookies of the researcher."""
    folder = tmp_path_factory.mktemp("up")
    with up(folder) as url:
        yield url, cookies_in(folder, url)


def key(page: Page, number: int) -> str:
    """The key that this person presses: never for what is dangerous, else each in turn."""
    left, right = (
        card.locator(".bad").count() > 0 for card in page.locator(".card, .moves [data-way]").all()
    )
    if left and right:
        return "n"
    if left or right:
        return "b" if left else "a"
    return ("a", "b", "e")[number % 3]


def answer(page: Page, number: int) -> str:
    """Wait for a question, press the key, wait until the page has moved on: the kind of the question.

    Who has refused all four moves ends the episode first.
    """
    page.locator("#question:visible, button:visible:text('End this episode')").first.wait_for()
    if page.get_by_role("button", name="End this episode").is_visible():
        page.get_by_role("button", name="End this episode").click()
    form = page.locator("#question")
    query, kind = form.get_attribute("data-query"), form.get_attribute("data-kind")
    page.wait_for_selector("#question[data-listening]")
    page.keyboard.press(key(page, number))
    page.wait_for_selector(f'#question[data-query="{query}"]', state="detached")
    return str(kind)


def raised(tabs: BrowserTabs, world: str, stage: int) -> dict[str, Any]:
    """A run with its answers by keyboard: what the API says of it."""
    run = create(tabs.address, world=world, config=STAGES[stage], goal=QUESTIONS, seed=5)
    dashboard = tabs.open(f"/runs/{run}")
    page = tabs.open(f"/runs/{run}/parent")
    page.set_default_timeout(30_000)
    for number in range(QUESTIONS // 2):
        answer(page, number)
    expect(dashboard.locator("#now-answered")).to_have_text(str(QUESTIONS // 2))  # it moves meanwhile
    halfway = dashboard.locator("#now-tick").inner_text()
    for number in range(QUESTIONS // 2, QUESTIONS):
        answer(page, number)
    expect(dashboard.locator("#now-tick")).not_to_have_text(halfway)
    expect(page.get_by_role("heading", name="That was the last question of this goal.")).to_be_visible()
    expect(dashboard.locator("#now-answered")).to_have_text(str(QUESTIONS))
    expect(dashboard.get_by_role("status")).to_contain_text(f"The goal of {QUESTIONS} answers is reached.")
    expect(dashboard.locator("#now-maturity")).to_have_text(str(stage))
    expect(dashboard.locator(".js-plotly-plot").first).to_be_visible()
    told: dict[str, Any] = httpx2.get(f"{tabs.address}/api/v1/runs/{run}").json()
    page.context.close()
    dashboard.context.close()
    return told


@pytest.mark.slow
@pytest.mark.torture
@pytest.mark.timeout(900)
@pytest.mark.parametrize(("world", "stage"), PLACES)
def test_answers_in_every_world_and_stage(
    browser: Browser, house: tuple[str, Any], world: str, stage: int
) -> None:
    url, cookies = house
    tabs = BrowserTabs(browser, url, cookies)
    run = raised(tabs, world, stage)
    assert (run["answers"], run["maturity"], run["resting"]) == (QUESTIONS, stage, True)
    assert run["status"] == "active"
    tabs.close()
    assert tabs.wrong == []
    until(lambda: httpx2.get(f"{url}/readyz").status_code == 200, 30, "the worker is gone")
