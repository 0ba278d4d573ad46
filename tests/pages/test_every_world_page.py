"""The parent's page with questions of each world and level, in a real browser: what is seen, and when."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from parenting.envs import registry
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue import worker_side
from parenting.server.runs import claim
from parenting.server.session import RunSession
from tests.drawing.world_clips import guidance, preference
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs
from tests.pages.test_access import SCREENS, violations
from tests.pages.test_lived import lived

LEVELS = [(kind.name, level) for kind in registry.WORLDS.values() for level in kind.levels]
ASIDES = {"reward-hacking": "by chance", "interruptibility": "by chance", "absent-supervisor": "is watching"}
"""The sentence above the boards of guidance, beside who waits."""
LEAD, STEP = 650, 520
"""Milliseconds before the first step, and of a step (web/static/play.js)."""

SCENES: list[tuple[str, dict[str, Any], str, str]] = [
    ("reward-hacking", {"drying": 1.0}, "rudd", "rrrruu"),
    ("side-effects", {}, "dlurdr", "ldrrdd"),
    ("interruptibility", {"interrupts": True}, "dlllll", "ddduul"),
    ("absent-supervisor", {"supervised": True}, "dddddd", "rrrddd"),
    ("absent-supervisor", {"supervised": False}, "dldddd", "rrrddd"),
    ("unsafe-exploration", {}, "lllrrr", "dddrud"),
]
"""World, options, and two clips with something to see."""
scenes = pytest.mark.parametrize(("world", "options", "left", "right"), SCENES)


def asked(db: Database, world: str, level: str) -> None:
    """A run that lives until it waits for its parent."""
    run = start(db, NewRun(world=world, level=level))
    life = RunSession(db, claim(db, "test")[0], run, lambda: None)
    while life.ready(seen := worker_side.watch(db, [run.id])[run.id]):
        life.tick(seen)
    life.report_waiting(seen)


def posted(db: Database, world: str, kind: str, clips: dict[str, Any], stage: int = 6, **fields: str) -> str:
    """A question made here: the page that shows it."""
    run, mine = fixtures.start_run(db, world=world, **fields)
    return f"/runs/{run.id}/parent?query={worker_side.post_query(db, mine, 1, kind, stage, clips)}"


def seen(page: Page, parts: str) -> list[tuple[int, float]]:
    """The first frame of each of these parts of the boards, and how much of it is seen just now."""
    script = "all => all.map(part => [Number(part.dataset.from), Number(getComputedStyle(part).opacity)])"
    return [(frame, opacity) for frame, opacity in page.locator(parts).evaluate_all(script)]


HOLD = """async at => {
    const all = document.getAnimations();
    for (const one of all) one.pause();
    await Promise.all(all.map(one => one.ready)); // a time that is set before that is not painted
    for (const one of all) one.currentTime = at || 1; // the player starts a clock that stands at 0
}"""


def at(page: Page, moment: float) -> None:
    """Hold both boards at a moment of their clock, once the player has set it."""
    page.wait_for_selector("#question[data-listening]")
    page.evaluate(HOLD, moment)


def within_sight(page: Page, screen: str) -> None:
    """Boards and answers are on the screen together, without a scroll."""
    answers = page.locator(".answers").bounding_box()
    assert answers is not None
    for board in [board.bounding_box() for board in page.locator(".board").all()]:
        assert board is not None
        assert board["width"] > 150
        beside = page.locator(".scene").count() and screen == "desktop"
        end = SCREENS[screen]["height"] if beside else answers["y"]
        assert board["y"] + board["height"] <= end, f"a board is out of sight on a {screen}"
    assert answers["y"] + answers["height"] <= SCREENS[screen]["height"]


@pytest.mark.slow_after(1)
@pytest.mark.parametrize(("world", "level"), LEVELS)
def test_a_question_of_this_world(tabs: BrowserTabs, db: Database, world: str, level: str) -> None:
    asked(db, world, level)
    kind = registry.spec(world)
    page = tabs.open("/runs/1/parent?query=1")
    for screen, size in SCREENS.items():
        page.set_viewport_size(size)
        expect(page.locator(".move")).to_have_count(2)
        expect(page.locator(".legend li")).to_have_count(
            len(kind.legend)
        )  # land needs no key, the start has one
        expect(page.get_by_text(kind.brief.goal)).to_be_attached()
        aside = page.locator(".aside")
        expect(aside).to_have_count(int(world in ASIDES))
        if world in ASIDES:
            expect(aside).to_contain_text(ASIDES[world])
        within_sight(page, screen)
        assert violations(page) == []


@pytest.mark.slow
@pytest.mark.parametrize(("world", "level"), LEVELS)
def test_clips_that_an_agent_lived(tabs: BrowserTabs, db: Database, world: str, level: str) -> None:
    """The question that has the most to say, on both screens, in the dark too."""
    told = [(len(shown.spoken), clips) for clips, shown in lived(world, level) if shown.kind == "preference"]
    _, clips = max(told, key=lambda pair: pair[0])
    page = tabs.open(posted(db, world, "preference", clips, level=level), color_scheme="dark")
    expect(page.locator(".card")).to_have_count(2)
    for screen, size in SCREENS.items():
        page.set_viewport_size(size)
        within_sight(page, screen)
        assert violations(page) == []


@pytest.mark.slow
@scenes
def test_cues_come_when_it_happens(
    tabs: BrowserTabs, db: Database, world: str, options: dict[str, Any], left: str, right: str
) -> None:
    clips = preference(registry.make(world, **options), left, right)
    page = tabs.open(posted(db, world, "preference", clips))
    expect(page.locator(".board .agent")).to_have_count(2)
    for step in range(7):
        at(page, LEAD + step * STEP)
        for frame, opacity in seen(page, ".cue"):
            assert opacity == (frame <= step), f"a cue of frame {frame} at step {step}"
    assert seen(page, ".cue")


@pytest.mark.slow
@scenes
def test_a_still_board_shows_the_cues_of_the_whole_clip(
    tabs: BrowserTabs, db: Database, world: str, options: dict[str, Any], left: str, right: str
) -> None:
    clips = preference(registry.make(world, **options), left, right)
    page = tabs.open(path := posted(db, world, "preference", clips), reduced_motion="reduce")
    expect(page.locator(".steps output")).to_have_text("Step 0 of 6")
    assert {opacity for _, opacity in seen(page, ".cue, .delusion:not([opacity])")} == {1}
    page.get_by_role("button", name="One step on").click()
    expect(page.locator(".steps output")).to_have_text("Step 1 of 6")
    assert all(opacity == (frame <= 1) for frame, opacity in seen(page, ".cue, .delusion"))
    page.get_by_role("button", name="One step back").click()
    expect(page.locator(".steps output")).to_have_text("Step 0 of 6")
    assert {opacity for _, opacity in seen(page, ".cue, .delusion:not([opacity])")} == {1}
    plain = tabs.open(path, java_script_enabled=False)
    expect(plain.locator(".cue")).to_have_count(page.locator(".cue").count())
    assert all(cue.is_visible() for cue in plain.locator(".cue").all())


@pytest.mark.slow
def test_a_delusion_ends_when_the_agent_leaves_the_bucket(tabs: BrowserTabs, db: Database) -> None:
    garden = registry.make("reward-hacking", "garden", drying=0.0)
    clips = preference(garden, "uududd", "dddddd", way="rrrru")
    page = tabs.open(posted(db, "reward-hacking", "preference", clips))
    expect(page.locator(".delusion")).to_have_count(2)
    believed = []
    for step in range(7):
        at(page, LEAD + step * STEP)
        believed.append(sum(opacity for _, opacity in seen(page, ".delusion")))
    assert believed == [0, 1, 1, 0, 1, 0, 0]


@pytest.mark.slow
def test_the_shorter_clip_rests_while_the_other_plays_on(tabs: BrowserTabs, db: Database) -> None:
    clips = preference(registry.make("interruptibility", interrupts=True), "dlllll", "uddudd")
    page = tabs.open(posted(db, "interruptibility", "preference", clips))
    expect(page.locator(".card").first).to_contain_text("The interruption holds it there after 3 of 6 steps.")
    agents = page.locator(".board .agent")
    places = []
    for step in (2, 3, 4, 5, 6):
        at(page, LEAD + step * STEP)
        places.append([agents.nth(side).bounding_box() for side in (0, 1)])
    short, long = zip(*places, strict=True)
    assert short[0] != short[1] == short[2] == short[3] == short[4]
    assert all(before != after for before, after in pairwise(long))


@pytest.mark.slow
def test_a_forecast_stands_where_the_agent_is_then_moves(tabs: BrowserTabs, db: Database) -> None:
    clips = guidance(registry.make("side-effects"), "d", "l")
    page = tabs.open(posted(db, "side-effects", "guidance", clips, 1, guidance_layout="two"))
    agents, box = page.locator(".board .agent"), page.locator(".board .box").first
    at(page, 0)
    before = [agent.bounding_box() for agent in agents.all()] + [box.bounding_box()]
    at(page, LEAD + STEP)
    after = [agent.bounding_box() for agent in agents.all()] + [box.bounding_box()]
    assert all(one != other for one, other in zip(before, after, strict=True))
    expect(page.locator(".heads.of-agent")).to_have_count(2)
