"""Sound and notification: off until a button is pressed, and only for those who wait or look elsewhere."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from parenting.server.db import Database
from parenting.server.runs import Claim
from tests.pages.browser_tabs import BrowserTabs, given, until
from tests.pages.parent_page import address

WRITTEN_DOWN = """() => {
  window.heard = [];
  window.Notification = class {
    static permission = "default";
    static async requestPermission() { heard.push("asked"); return this.permission = "granted"; }
    constructor(words) { heard.push(words); }
    addEventListener() {}
  };
  const start = AudioScheduledSourceNode.prototype.start;
  AudioScheduledSourceNode.prototype.start = function (...when) {
    heard.push("tone");
    return start.apply(this, when);
  };
  const now = performance.now.bind(performance);
  let back = 0;
  performance.now = () => now() - back;
  window.early = (is) => { back = is ? 600000 : 0; };
  let hidden = false;
  Object.defineProperty(document, "hidden", { get: () => hidden });
  window.hide = (now) => { hidden = now; document.dispatchEvent(new Event("visibilitychange")); };
}"""


def heard(page: Page) -> list[str]:
    """Return all that the page sounded, asked and showed since this was last called."""
    found: list[str] = page.evaluate("heard.splice(0)")
    return sorted(found)


@pytest.mark.slow
def test_a_question_is_told_of_to_those_who_asked_for_it_and_look_elsewhere(
    tabs: BrowserTabs, db: Database, mine: Claim, ask: Callable[..., int]
) -> None:
    page = tabs.open("/practice")
    page.add_init_script(f"({WRITTEN_DOWN})()")
    loaded: list[str] = []
    page.on("request", lambda request: loaded.append(request.url))
    page.goto(tabs.address + address(db))
    button = page.locator("#waiting .bell")
    expect(button).to_have_attribute("aria-pressed", "false")
    ask()
    page.wait_for_selector("#question[data-listening]")
    page.keyboard.press("e")
    expect(button).to_be_visible()
    assert heard(page) == []
    assert not [url for url in loaded if "sound" in url]
    button.click()
    expect(button).to_have_attribute("aria-pressed", "true")
    until(lambda: page.evaluate("heard.length") == 3)
    assert heard(page) == ["asked", "tone", "tone"]
    assert len([url for url in loaded if "sound" in url]) == 1
    page.evaluate("early(true)")  # so that nobody has waited for long, however slow the machine is
    ask()  # the page is seen
    page.wait_for_selector("#question[data-listening]")
    page.evaluate("early(false)")  # else the page believes that it hears of the run once it is hidden
    page.keyboard.press("e")
    until(lambda: len(given(db)) == 2)
    expect(button).to_be_visible()
    assert heard(page) == []
    page.evaluate("hide(true)")
    ask()
    until(lambda: page.evaluate("heard.length") == 3)
    words = page.locator("#main").get_attribute("data-name")
    assert heard(page) == [f"The agent needs you · {words}", "tone", "tone"]
    page.evaluate("hide(false)")
    page.reload()
    page.locator("#help-open").click()
    off = page.locator("#help .bell")
    expect(off).to_have_attribute("aria-pressed", "true")
    off.click()
    expect(off).to_have_attribute("aria-pressed", "false")
    assert heard(page) == []
    assert page.evaluate("localStorage.getItem('parenting.bell')") == "off"


@pytest.mark.slow
def test_whoever_has_waited_for_long_is_told_although_the_page_is_seen(
    tabs: BrowserTabs, db: Database, mine: Claim, ask: Callable[..., int]
) -> None:
    page = tabs.open("/practice")
    page.add_init_script(f"({WRITTEN_DOWN})()")
    page.add_init_script("localStorage.setItem('parenting.bell', 'on')")
    page.clock.install()
    page.goto(tabs.address + address(db))
    expect(page.locator("#waiting .bell")).to_have_attribute("aria-pressed", "true")
    page.clock.fast_forward(6000)
    ask()
    page.clock.run_for(1000)
    page.wait_for_selector("#question")
    page.locator("h1").first.click()  # a browser keeps the sound until somebody has used the page
    page.clock.run_for(1000)
    until(lambda: page.evaluate("heard.length") == 2)
    assert heard(page) == ["tone", "tone"]
