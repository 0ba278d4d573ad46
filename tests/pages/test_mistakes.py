"""Nothing is answered by mistake: one act answers one question, and only one that could be seen."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from parenting.server.db import Database
from parenting.server.settings import Settings
from tests.pages.browser_tabs import BrowserTabs, given, until
from tests.pages.parent_page import named

AFTER = 700
"""Milliseconds: longer than the default, for a slow machine."""
EITHER = ".answers button[value=either]"


@pytest.fixture
def settings(settings: Settings) -> Settings:
    return settings.model_copy(update={"listen_after_ms": AFTER})


def double_click(page: Page) -> None:
    page.dblclick(EITHER)


def bouncing_mouse(page: Page) -> None:
    box = page.locator(EITHER).bounding_box()
    assert box
    for _ in range(3):
        page.mouse.click(box["x"] + 5, box["y"] + 5, delay=5)


def double_press(page: Page) -> None:
    page.keyboard.press("e")
    page.keyboard.press("e")


def held_key(page: Page) -> None:
    for _ in range(20):
        page.keyboard.down("e")
    page.keyboard.up("e")


def enter_on_a_stale_focus(page: Page) -> None:
    page.focus(EITHER)
    page.keyboard.press("Enter")
    page.keyboard.press("Enter")


def screen_reader(page: Page) -> None:
    """Its click has no pointer, and may come with a key."""
    page.evaluate("at => { for (let k = 0; k < 2; k++) document.querySelector(at).click(); }", EITHER)


EARLY = """(function look() {
  const form = document.querySelector("#question"), all = [...form?.querySelectorAll("[name=choice]") ?? []];
  const pale = all.length && all.every((button) => button.ariaDisabled === "true");
  if (!pale) return requestAnimationFrame(look);
  window.early = !("listening" in form.dataset);
  form.dispatchEvent(new KeyboardEvent("keydown", { key: "e", bubbles: true }));
  all[0].click();
})()"""
"""Press a key and a button once they are pale: done by the page itself, so that it cannot come too late."""

ACTS = [double_click, bouncing_mouse, double_press, held_key, enter_on_a_stale_focus, screen_reader]


def test_one_act_answers_one_question(tabs: BrowserTabs, db: Database, ask: Callable[..., int]) -> None:
    numbers = [ask() for _ in range(len(ACTS) + 1)]
    page = tabs.open("/runs/1/parent")
    for number, act in enumerate(ACTS, start=1):
        page.wait_for_selector(f'#question[data-query="{named(page, numbers[number - 1])}"][data-listening]')
        page.wait_for_selector(
            "#question[data-ahead]:not([data-ahead=''])"
        )  # so that the next one comes at once
        act(page)
        shown = f'#question[data-query="{named(page, numbers[number])}"]'
        page.wait_for_selector(f"{shown}[data-listening]")
        until(lambda number=number: len(given(db)) >= number)  # type: ignore[misc]  # a lambda of a loop
        assert given(db) == [(query, "either") for query in numbers[:number]], act.__name__


def test_a_question_that_does_not_listen_yet_says_so_and_applies_nothing_late(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    ask()
    page = tabs.open("/")
    page.add_init_script(EARLY)
    page.goto(f"{tabs.address}/runs/1/parent")
    page.wait_for_selector("#question[data-listening]")
    assert page.evaluate("window.early") is True
    expect(page.locator("#question button[aria-disabled]")).to_have_count(0)
    assert page.locator("#count").text_content() == "0"
    assert given(db) == []
    page.keyboard.press("e")
    until(lambda: len(given(db)) == 1)
