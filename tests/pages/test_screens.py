"""A whole question fits the screen without scrolling: every built-in level, both kinds, five screens."""

from __future__ import annotations

import pytest
from playwright.sync_api import Page

from parenting.envs import registry
from parenting.server.db import Database
from tests.drawing.world_clips import guidance, preference
from tests.pages.browser_tabs import BrowserTabs
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
