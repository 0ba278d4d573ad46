"""A whole question fits the screen without scrolling: every built-in level, both kinds, five screens."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from parenting.envs import registry
from parenting.server.db import Database
from tests.drawing.world_clips import guidance, preference
from tests.pages.browser_tabs import BrowserTabs
from tests.pages.parent_page import address, shown
from tests.pages.test_every_world_page import LEVELS, posted

SCREENS = ((1280, 720), (1366, 768), (390, 844), (844, 390), (320, 568))
PARTS = "#question h1, .answers button, .meeting, .card:not([value=right]) .board"
CELL = 16
"""Pixels of a cell at least."""


def outside(page: Page) -> list[str]:
    """The parts of the question that are not on the screen, or whose cells are too small."""
    script = f"""all => all.flatMap(part => {{
        const box = part.getBoundingClientRect(), bar = document.querySelector(".answers");
        const cell = part.viewBox ? box.width / part.viewBox.baseVal.width * 20 : {CELL};
        const fixed = !part.closest(".answers") && getComputedStyle(bar).position === "fixed";
        const end = fixed ? bar.getBoundingClientRect().top : innerHeight;
        const there = box.top >= 0 && box.left >= 0 && box.bottom <= end + .5 && box.right <= innerWidth;
        return there && cell >= {CELL} ? [] : [part.outerHTML.slice(0, 60) + ` ${{box.bottom}}, ${{cell}}`];
    }})"""
    found: list[str] = page.locator(PARTS).evaluate_all(script)
    return found


@pytest.mark.slow_after(1)
@pytest.mark.parametrize(("world", "level"), LEVELS)
def test_a_question_fits_every_screen(tabs: BrowserTabs, db: Database, world: str, level: str) -> None:
    made = registry.make(world, level)
    wrong = {}
    for kind, clips in (("guidance", guidance(made, "u", "l")), ("preference", preference(made, "ul", "dr"))):
        page = tabs.open(posted(db, world, kind, clips, 1 if kind == "guidance" else 2, level=level))
        for width, height in SCREENS:
            page.set_viewport_size({"width": width, "height": height})
            if found := outside(page):
                wrong[kind, width, height] = found
    assert wrong == {}


SIZES = ((768, 1024), (820, 1180), (844, 390), (932, 430), (960, 540), (1024, 768), (390, 844), (320, 568))
SAID = ("", "Saving", "Saved", "Taken back", "Kept here, not sent yet", "Kept here, not stored")


@pytest.mark.slow
def test_the_question_stays_where_it_is_whatever_is_said_of_the_answer(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    page = tabs.open(address(db))
    shown(page, ask())
    tops = """all => all.map(words => {
        document.getElementById("saved").textContent = words;
        return document.getElementById("stage").getBoundingClientRect().top;
    })"""
    for left in ("", "about 12 minutes left"):
        page.evaluate("words => { document.getElementById('left').textContent = words; }", left)
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            assert len(set(page.evaluate(tops, SAID))) == 1, (width, height, left)
            assert page.evaluate("document.documentElement.scrollWidth") <= width


FIELD = "\n".join(
    (
        "world: unsafe-exploration",
        "name: field",
        "",
        "W" * 20,
        f"WA{' ' * 17}W",
        *([f"W{' ' * 18}W"] * 16),
        f"WG{' ' * 17}W",
        "W" * 20,
    )
)
"""A level of twenty by twenty cells, none of which is wall."""
ALONG = "r" * 15
"""The agent's way before the question: it stands at the right then."""
WIDE, NARROW = ((1280, 720), (1366, 768), (390, 844)), ((844, 390), (320, 568))


def field(tabs: BrowserTabs, db: Database, kind: str) -> Page:
    """A question on this level."""
    made = registry.make("unsafe-exploration", FIELD)
    clips = guidance(made, "u", "d", ALONG) if kind == "guidance" else preference(made, "dl", "rd", ALONG)
    path = posted(db, "unsafe-exploration", kind, clips, 1 if kind == "guidance" else 2, level_text=FIELD)
    return tabs.open(path)


@pytest.mark.slow
def test_twenty_by_twenty_cells_fit(tabs: BrowserTabs, db: Database) -> None:
    """Guidance whole; of two clips on a small screen one large board at a time, in lock-step."""
    page = field(tabs, db, "guidance")
    for width, height in WIDE:
        page.set_viewport_size({"width": width, "height": height})
        assert outside(page) == [], (width, height)
    page = field(tabs, db, "preference")
    page.set_viewport_size({"width": 390, "height": 844})
    assert outside(page) == []
    shown = page.locator(".card:visible .board")
    expect(shown).to_have_count(1)
    first = shown.element_handle()
    page.keyboard.press("o")
    assert not shown.element_handle().evaluate("(one, other) => one === other", first)
    clocks = "new Set(document.getAnimations().map(({ currentTime }) => currentTime)).size"
    assert page.evaluate(clocks) == 1
    shown.click()
    assert shown.element_handle().evaluate("(one, other) => one === other", first)
    assert outside(page) == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["guidance", "preference"])
def test_where_not_all_fits_it_scrolls_and_the_buttons_stay(
    tabs: BrowserTabs, db: Database, kind: str
) -> None:
    page = field(tabs, db, kind)
    for width, height in (*WIDE, *NARROW):
        page.set_viewport_size({"width": width, "height": height})
        page.reload()
        page.wait_for_selector("#question[data-listening]")  # the stream's question has taken its place
        for share in (0, 0.5, 1):
            page.evaluate("share => scrollTo(0, share * document.body.scrollHeight)", share)
            small = [part for part in outside(page) if "button" in part or float(part.split()[-1]) < CELL]
            assert small == [], (width, height, share)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        figure, board = page.locator(".agent:visible").first, page.locator(".board:visible").first
        expect(figure).to_be_visible()
        agent = figure.bounding_box()
        assert agent is not None
        assert 0 <= agent["x"] <= width - agent["width"], (width, height)
        expect(board).to_be_visible()
