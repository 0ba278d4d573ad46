"""Everybody can use the pages: axe's rules, small screens, no motion, few bytes."""

from __future__ import annotations

import gzip
from collections.abc import Sequence
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Page, ViewportSize, expect

from parenting.server import operator_events, runs
from parenting.server.db import Database
from parenting.server.progress import report_progress
from parenting.server.queue import answers
from parenting.server.queue.worker_side import take_answer
from parenting.server.runs import Claim
from parenting.server.statuses import RunStatus
from parenting.server.tables import Effect, Reason
from tests.lengths import length
from tests.pages import island_fixtures as fixtures
from tests.pages.axe import violated
from tests.pages.browser_tabs import BrowserTabs
from tests.simulated_person import until

SCREENS: dict[str, ViewportSize] = {
    "desktop": {"width": 1280, "height": 800},
    "phone": {"width": 390, "height": 844},
}
SIZES: tuple[ViewportSize, ...] = (SCREENS["desktop"], {"width": 320, "height": 568})
PATHS = (
    "/",
    "/?q=island&sort=name&archived=true",
    "/levels",
    "/access",
    "/audit",
    "/persons",
    "/practice",
    "/practice?at=1&choice=left",
    "/practice?at=4",
    "/practice?at=6",
    "/runs/1",
    "/runs/1/end",
    "/runs/1/settings",
    "/runs/1/delete",
    "/runs/1/history",
    "/runs/1/why?query=3",
    "/runs/1/parent?query=1",
    "/runs/1/parent?query=2",
    "/runs/2",
    "/runs/2/parent",
    "/runs/3",
    "/runs/3/parent",
    "/runs/4",
    "/runs/9",
)
MOST_SEEN = ("/runs/1/parent?query=1",)
OTHERS = [path for path in PATHS if path not in MOST_SEEN]
LARGEST_PAGE = 16_800
"""Bytes of the parent's page with all that it loads, compressed."""


@pytest.fixture
def lives(db: Database) -> None:
    """Four runs in different states.

    One has two open questions and an answered one, one waits for its operator, one rests at its goal in its
    second stage, and one failed.
    """
    _, mine = fixtures.start_run(db)
    fixtures.measure(db, mine, 40)
    fixtures.ask(db, mine, 41, "guidance", fixtures.guidance("left", "up", start=(1, 2)))
    fixtures.ask(db, mine, 42, "preference", fixtures.preference("down left left left", "right down down"))
    told = fixtures.ask(db, mine, 43, "preference", fixtures.preference("left left", "down"))
    answers.answer(db, told, "left", "me", "human")
    explain(db, mine, 43)
    guided = fixtures.ask(db, mine, 44, "guidance", fixtures.guidance("left", "up", start=(1, 2)))
    answers.answer(db, guided, "neither", "me", "human")
    _, other = fixtures.start_run(db, level="island-bottleneck")
    report_progress(db, other, waiting="stuck", optimal=True)
    _, third = fixtures.start_run(db, goal=1, pace=2.5, config={"stages": 2})
    fixtures.measure(db, third, 40)
    report_progress(db, third, maturity=2)
    operator_events.add_operator_event(db, 3, "end_episode", {})
    answers.answer(
        db, fixtures.ask(db, third, 41, "guidance", fixtures.guidance("up", "left")), "left", "me", "human"
    )
    _, fourth = fixtures.start_run(db)
    runs.finish(db, fourth, RunStatus.FAILED, "The agent could not go on.")


def explain(db: Database, mine: Claim, tick: int) -> None:
    """The answer of a preference is heard, with all that is kept of why it was asked and what changed."""
    take_answer(db, mine, tick + 1)
    there = {"probabilities": [0.1, 0.2, 0.3, 0.4]}
    clips = {side: {"kind": "exploratory", "first": 3, "last": 4} for side in ("left", "right")}
    with db.write() as session:
        why = {"p_pref": 0.3, "draw": 0.2, "clips": clips, **there}
        session.add(Reason(run_id=mine.run_id, tick=tick, why=why))
        session.add(Effect(run_id=mine.run_id, tick=tick + 1, ticks=0, policy=there))


def violations(page: Page, **options: Any) -> list[str]:
    """The findings of axe, a line each, with the first element; `options` choose its rules."""
    found = violated(page, **options)
    return [f"{rule['id']}: {rule['help']}: {rule['nodes'][0]['html']}" for rule in found]


def light_and_dark(page: Page) -> list[str]:
    """The findings of all rules in the light, and in the dark of those about colours, which alone change."""
    page.emulate_media(color_scheme="light")
    found = violations(page)
    page.emulate_media(color_scheme="dark")
    return found + violations(page, runOnly=["color-contrast", "link-in-text-block"])


def everywhere(page: Page) -> list[str]:
    """The findings on the largest and the smallest screen, and on the largest one in the dark."""
    page.emulate_media(color_scheme="light")
    page.set_viewport_size(SIZES[-1])
    small = [f"{SIZES[-1]['width']}: {line}" for line in violations(page)]
    page.set_viewport_size(SIZES[0])
    return small + light_and_dark(page)


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("paths", [MOST_SEEN, OTHERS[::2], OTHERS[1::2]], ids=["most seen", "others", "more"])
def test_axe_finds_nothing(tabs: BrowserTabs, lives: None, paths: Sequence[str]) -> None:
    """It takes long because axe looks at each page on two screens, one of them in both schemes."""
    tabs.expected = ("404", "422")
    page = tabs.open("/")
    for path in paths:
        page.goto(tabs.address + path)
        page.wait_for_timeout(100)
        assert everywhere(page) == [], path


@pytest.mark.slow
def test_axe_finds_nothing_in_states_that_come_later(tabs: BrowserTabs, lives: None) -> None:
    """The help, wrong fields, all that a waiting page can say, and an answer that is changed."""
    tabs.expected = ("404", "422")
    page = tabs.open("/runs/2/parent")
    page.evaluate("for (const part of document.querySelectorAll('main [hidden]')) part.hidden = false")
    page.evaluate("document.getElementById('alert').textContent = 'Your answer was not used.'")
    assert everywhere(page) == []
    page.goto(f"{tabs.address}/runs/1/parent")
    page.wait_for_selector("#question[data-listening]")
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_be_visible()  # it is loaded when it is asked for
    assert everywhere(page) == []
    page.keyboard.press("Escape")
    page.keyboard.press("e")
    page.keyboard.press("z")
    expect(page.locator("#count")).to_have_text("2")
    assert everywhere(page) == []
    page.goto(f"{tabs.address}/runs/1")
    page.get_by_label("p_rec").fill("often")
    page.get_by_role("button", name="Change").click()
    expect(page.locator("#p_rec-error")).to_be_visible()
    assert everywhere(page) == []
    page.goto(tabs.address)
    page.get_by_text("More settings").click()
    page.get_by_label("Seed").fill("many")
    page.get_by_role("button", name="Start").click()
    expect(page.locator("#seed-error")).to_be_visible()
    assert everywhere(page) == []


def test_axe_finds_what_is_wrong(tabs: BrowserTabs) -> None:
    """The control: a picture without a text is found, and a text that is too faint in the dark alone."""
    page = tabs.open("/")
    page.evaluate("document.querySelector('main').append(new Image())")
    assert any("image-alt" in line for line in violations(page))
    faint = "@media (prefers-color-scheme: dark) { h1, h2 { color: #222 !important; } }"
    page.evaluate("rule => document.styleSheets[0].insertRule(rule)", faint)
    assert [line.partition(":")[0] for line in light_and_dark(page)] == ["image-alt", "color-contrast"]


@pytest.mark.slow
@pytest.mark.torture
@pytest.mark.parametrize("width", length([320], [320, 390]))
def test_nothing_scrolls_sideways(tabs: BrowserTabs, lives: None, width: int) -> None:
    tabs.expected = ("404",)
    page = tabs.open("/", viewport={"width": width, "height": 640})
    wide: dict[str, int] = {}
    for path in PATHS:
        page.goto(tabs.address + path)
        page.wait_for_timeout(150)
        wide[path] = page.evaluate("document.documentElement.scrollWidth")
    assert {path: found for path, found in wide.items() if found > width} == {}


def test_on_a_phone_four_thumb_buttons_lie_at_the_bottom(tabs: BrowserTabs, lives: None) -> None:
    page = tabs.open("/runs/1/parent?query=1", viewport=SCREENS["phone"])
    boxes: list[Any] = [button.bounding_box() for button in page.locator(".answers button").all()]
    assert len(boxes) == 4
    assert all(box["height"] >= 56 and box["y"] > 844 - 150 for box in boxes)
    board = page.locator(".board.meeting").bounding_box()
    assert board is not None
    assert board["y"] + board["height"] < boxes[0]["y"]
    assert page.locator(".badge").all_inner_texts() == ["A", "B"]


def test_on_a_desktop_the_question_needs_no_scrolling(tabs: BrowserTabs, lives: None) -> None:
    page = tabs.open("/runs/1/parent?query=2", viewport=SCREENS["desktop"])
    left, right = (card.bounding_box() for card in page.locator(".card").all())
    assert left is not None
    assert right is not None
    assert (left["width"], left["height"], left["y"]) == (right["width"], right["height"], right["y"])
    brief = page.locator(".brief").bounding_box()
    assert brief is not None
    assert brief["y"] + brief["height"] <= 800


@pytest.mark.slow
def test_who_wants_no_motion_gets_steps(tabs: BrowserTabs, lives: None) -> None:
    page = tabs.open("/runs/1/parent?query=2", reduced_motion="reduce")
    moving = "document.getAnimations().filter(a => a.playState === 'running').length"
    assert page.evaluate(moving) == 0
    agent = page.locator(".card").nth(1).locator(".board .agent")
    expect(page.locator(".steps output")).to_have_text("Step 0 of 4")
    start = agent.bounding_box()
    page.get_by_role("button", name="One step on").click()
    expect(page.locator(".steps output")).to_have_text("Step 1 of 4")
    assert agent.bounding_box() != start
    page.get_by_role("button", name="One step back").click()
    assert agent.bounding_box() == start


def test_both_boards_play_on_one_clock(tabs: BrowserTabs, lives: None) -> None:
    page = tabs.open("/runs/1/parent?query=2")
    expect(page.locator("#question[data-listening]")).to_be_visible()  # the player came with it
    times = (
        "[...new Set(document.getAnimations().filter(a => a.effect.target.closest('.board')).map(a => a.%s))]"
    )
    assert len(page.evaluate(times % "startTime")) == 1
    page.get_by_role("button", name="One step on").click()
    assert len(page.evaluate(times % "currentTime")) == 1


def test_the_parents_page_is_small(client: httpx2.Client, lives: None) -> None:
    paths = ["/runs/1/parent?query=2", "/static/site.css", "/static/parent.css", "/static/icon.svg"]
    paths += [f"/static/{name}.js" for name in ("parent", "live", "left", "outbox", "play")]
    sizes = {path: len(gzip.compress(client.get(path, follow_redirects=True).content)) for path in paths}
    assert sum(sizes.values()) <= LARGEST_PAGE, sizes


@pytest.mark.slow
def test_the_charts_are_drawn_and_go_on(tabs: BrowserTabs, db: Database, lives: None) -> None:
    page = tabs.open("/runs/1")
    lines = page.locator(".plot .scatterlayer .trace")
    expect(lines).to_have_count(15)
    (mine,) = (claim for claim in runs.claim(db, "another", seconds=-1) if claim.run_id == 1)
    fixtures.measure(db, mine, 55)
    expect(page.locator("#now-tick")).to_have_text("55")
    drawn = "[...document.querySelectorAll('.plot')].every(plot => plot._fullLayout.xaxis.range[1] >= 55)"
    until(lambda: page.evaluate(drawn), 10, "the charts do not go on")
    fixtures.measure(db, mine, 56, begin=56)
    until(lambda: page.evaluate(drawn.replace("55", "56")), 10, "the charts do not go on a second time")
    log = page.get_by_role("button", name="Logarithmic axis for Loss")
    log.click()
    expect(log).to_have_attribute("aria-pressed", "true")
    with page.expect_download() as saved:
        page.get_by_role("button", name="Download Deaths as an image").click()
    public = page.locator("#main").get_attribute("data-run")
    assert saved.value.suggested_filename == f"run-{public}-deaths.png"


@pytest.mark.slow
def test_the_dashboard_without_javascript_is_a_table(tabs: BrowserTabs, lives: None) -> None:
    page = tabs.open("/runs/1", java_script_enabled=False)
    expect(page.locator("#charts")).to_be_hidden()
    expect(page.get_by_role("region", name="Numbers by stage").get_by_role("table")).to_be_visible()
    page.get_by_text("The numbers as a table").click()
    expect(page.get_by_role("region", name="Numbers by tick").get_by_role("table")).to_be_visible()
