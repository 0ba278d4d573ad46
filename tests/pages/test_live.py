"""The additions of the scripts: numbers that move, clips that play, the time that is left."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from parenting.server import runs
from parenting.server.db import Database
from parenting.server.notify import Notifier
from parenting.server.progress import report_progress
from parenting.server.queue import answers, worker_side
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs, until
from tests.pages.parent_page import shown


def table(page: Page) -> list[str]:
    """The stages, a line each."""
    return [" ".join(row.inner_text().split()) for row in page.locator("tr[data-stage]").all()]


@pytest.mark.slow
def test_the_table_of_stages_grows_as_it_is_drawn(tabs: BrowserTabs, db: Database) -> None:
    """The script makes of the metrics what the server makes of them."""
    _, mine = fixtures.start_run(db, config={"stages": 3, "mature_every": 20})
    page = tabs.open("/runs/1")
    expect(page.locator("tr[data-stage]")).to_have_count(3)
    assert table(page) == ["1 now – – – – – –", "2 – – – – – –", "3 – – – – – –"]
    fixtures.measure(db, mine, 30)
    fixtures.measure(db, mine, 50, begin=31, maturity=2)
    report_progress(db, mine, maturity=2)
    expect(page.locator("tr.now")).to_contain_text("2")
    expect(page.locator("tr.now")).to_contain_text("31 to 50")
    drawn = table(page)
    still = tabs.open("/runs/1", java_script_enabled=False)
    assert table(still) == drawn
    assert drawn[0].endswith("0 to 31")
    assert drawn[2].startswith("3 – –")
    expect(page.locator("#now-maturity")).to_have_text("2")
    plots = "[...document.querySelectorAll('.plot')].map(plot => plot.layout.shapes?.map(line => line.x0))"
    until(lambda: page.evaluate(plots) == [[31]] * 4 + [None] + [[31]] * 3)  # one chart after the other
    bars = "document.querySelector('[data-chart=stages] .plot').data[0].y"
    until(lambda: len(page.evaluate(bars)) == 2)


@pytest.mark.slow
def test_an_event_gets_its_tick_on_the_page(tabs: BrowserTabs, db: Database) -> None:
    _, mine = fixtures.start_run(db, config={"stages": 2})
    page = tabs.open("/runs/1")
    page.get_by_label("p_guid", exact=True).fill("0.5")
    page.get_by_role("button", name="Change").click()
    expect(page.locator("#events li")).to_have_text("Set p_guid to 0.5 before the next tick")
    worker_side.take_operator_events(db, mine, 8)
    report_progress(db, mine, tick=8)
    expect(page.locator("#events li")).to_have_text("Set p_guid to 0.5 at tick 8")


def test_the_buttons_go_by_what_holds(tabs: BrowserTabs, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    page = tabs.open("/runs/1")
    for name in ("Pause", "End the episode", "Answer questions"):
        expect(page.get_by_role("button", name=name).or_(page.get_by_role("link", name=name))).to_be_visible()
    for name in ("Resume", "50 more"):
        expect(page.get_by_role("button", name=name)).to_be_hidden()
    runs.set_status(db, 1, RunStatus.PAUSED)
    expect(page.get_by_role("button", name="Resume")).to_be_visible()
    expect(page.get_by_role("button", name="Pause")).to_be_hidden()
    runs.set_status(db, 1, RunStatus.ACTIVE)
    report_progress(db, mine, waiting="stuck")
    expect(page.get_by_role("button", name="End the episode")).to_have_count(2)
    runs.set_status(db, 1, RunStatus.STOPPED, "Stopped by the operator.")
    expect(page.get_by_text("Stopped by the operator.")).to_be_visible()
    expect(page.get_by_role("button", name=re.compile("Pause|Set|Change|episode"))).to_have_count(0)


@pytest.mark.slow
def test_the_clips_of_an_answer_play_while_it_is_pointed_at(tabs: BrowserTabs, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    for tick in (1, 2):
        query = fixtures.ask(db, mine, tick, "preference", fixtures.preference("left left", "down down"))
        answers.answer(db, query, "left", "me", "human")
    page = tabs.open("/runs/1/history")
    entries = page.locator(".entry")

    def playing(at: int) -> int:
        moving = (
            "entry => entry.getAnimations({ subtree: true }).filter(a => a.playState === 'running').length"
        )
        return int(entries.nth(at).evaluate(moving))

    assert playing(0) == playing(1) == 0
    entries.nth(0).hover()
    assert playing(0) > 0
    entries.nth(1).hover()
    assert playing(0) == 0
    assert playing(1) > 0
    page.mouse.move(0, 0)
    assert playing(1) == 0
    play = entries.nth(0).get_by_role("button", name="Play")
    play.focus()
    assert playing(0) > 0
    step = entries.nth(0).get_by_role("button", name="One step on")
    step.click()
    expect(entries.nth(0).locator("output")).to_have_text(re.compile("Step . of 2"))
    calm = tabs.open("/runs/1/history", reduced_motion="reduce")
    calm.locator(".entry").first.hover()
    expect(calm.locator(".entry output").first).to_have_text("Step 0 of 2")
    assert calm.evaluate("document.getAnimations().filter(a => a.playState === 'running').length") == 0
    still = tabs.open("/runs/1/history", java_script_enabled=False)
    expect(still.locator("svg.board .trail.of-agent")).to_have_count(4)
    expect(still.get_by_role("button", name="Play")).to_have_count(0)


@pytest.mark.slow
def test_the_time_that_is_left_of_a_goal(tabs: BrowserTabs, db: Database, settings: Settings) -> None:
    _, mine = fixtures.start_run(db, goal=6)
    for tick in range(1, 8):
        fixtures.ask(db, mine, tick, "preference", fixtures.preference("left left", "down down"))
    Notifier(settings.data, "web").notify()
    page = tabs.open("/runs/1/parent")
    expect(page.locator("#goal")).to_have_text("of 6")
    for count in range(1, 6):
        shown(page, count)
        expect(page.locator("#left")).to_have_text("" if count < 5 else "about 1 min")
        page.keyboard.press("a")
        expect(page.locator("#count")).to_have_text(str(count))
    shown(page, 6)
    page.keyboard.press("a")
    expect(page.get_by_role("heading", name="That was the last question of this goal.")).to_be_visible()
    expect(page.locator("#left")).to_have_text("")
    page.get_by_role("button", name="50 more").click()
    expect(page.locator("#goal")).to_have_text("of 56")
    page.get_by_role("button", name="50 more").wait_for(state="hidden")


def test_it_is_told_from_the_median_of_the_last_answers(tabs: BrowserTabs, db: Database) -> None:
    fixtures.start_run(db, goal=50)
    page = tabs.open("/")
    page.evaluate("localStorage.setItem('parenting.times', '[100, 3000, 3000, 3500, 90000]')")
    page.goto(f"{tabs.address}/runs/1/parent")
    expect(page.locator("#goal")).to_have_text("of 50")
    expect(page.locator("#left")).to_have_text("about 3 min")
    page.evaluate("document.getElementById('saved').textContent = 'Saved'")
    for width in (320, 390):
        page.set_viewport_size({"width": width, "height": 640})
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    words = page.evaluate("import('/static/eta.js').then(({ timeLeft }) => [5, 50, 5000, 0].map(timeLeft))")
    assert words == ["about 1 min", "about 3 min", "about 4 h", ""]
