"""The parent's pages in a language that is made for these tests: accents on letters, longer sentences.

A plain letter on a page is a sentence that is not in the catalogue.
"""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Page, expect

from parenting.envs import registry
from parenting.server.db import Database
from parenting.server.pages.texts import world_title
from parenting.server.queue.answers import answer
from parenting.server.settings import Settings
from scripts.catalogue import compile_language, pseudo
from tests.drawing.world_clips import guidance, preference
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs
from tests.pages.test_every_world_page import LEVELS, SCENES, posted

SHOWN = ("aria-label", "title", "alt", "placeholder", "data-title", "data-spoken", "data-said")
"""Attributes that people read or hear."""
DATA = {"bdi", "code", "kbd", "time", "script", "style", "text"}
"""Elements whose text is not a sentence: names that people give, keys, times, letters on a board."""
WORD = re.compile(r"[A-Za-z]{2,}")
TITLES = [f"{world_title(world)}, {level}" for world, level in LEVELS]
NAMES = re.compile("|".join(["Parenting", "JSON", r"\(p[0-9a-z]+\)", *TITLES]))
"""Names, which stay as they are."""
PATHS = (
    "/runs/1/parent?query=5",
    "/runs/1/parent",
    "/help",
    "/runs/1/history",
    "/runs/1/end",
    "/runs/9/parent",
    "/runs/1/growth",
    "/practice",
    "/practice?at=4&choice=left",
    "/practice?at=6",
)
PHONE = {"width": 320, "height": 640}


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    languages = tmp_path / "languages"
    for tag in ("de", "ar"):
        compile_language(pseudo(tag), languages / tag)
    return Settings(data=tmp_path, database_url=None, listen_after_ms=0, languages=languages)


class Texts(HTMLParser):
    """The words of a page that are not in the catalogue, each with the text that it is in."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.english: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in ("input", "link", "meta", "br", "img", "path", "rect", "use", "circle"):
            self.open.append(tag)
        for name, text in attrs:
            if name in SHOWN:
                self._look(text or "")

    def handle_endtag(self, tag: str) -> None:
        while self.open and self.open.pop() != tag:
            pass

    def handle_data(self, data: str) -> None:
        if not DATA & set(self.open):
            self._look(data)

    def _look(self, text: str) -> None:
        if WORD.search(NAMES.sub("", text)):
            self.english.append(text.strip())


def english(client: httpx2.Client, path: str, tag: str = "de") -> list[str]:
    """Return what a page says in English to a browser that asks for another language."""
    page = client.get(path, headers={"accept-language": tag}).text
    return Texts(page).english


def lived(db: Database) -> None:
    """A run with a question, and with answers of each kind."""
    _, mine = fixtures.start_run(db, goal=50)
    for tick, choice in enumerate(("left", "right", "either", "neither"), 1):
        clips = fixtures.preference("down left left left", "right down down")
        answer(db, fixtures.ask(db, mine, tick, "preference", clips), choice, "me", "human")
    fixtures.ask(db, mine, 5, "guidance", fixtures.guidance("left", "up", start=(1, 2)))


def test_every_page_is_in_the_catalogue(client: httpx2.Client, db: Database) -> None:
    lived(db)
    found = {path: english(client, path) for path in PATHS}
    assert {path: texts for path, texts in found.items() if texts} == {}


@pytest.mark.slow_after(1)
@pytest.mark.parametrize(("world", "options", "left", "right"), SCENES)
def test_every_question_is_in_the_catalogue(
    client: httpx2.Client, db: Database, world: str, options: dict[str, Any], left: str, right: str
) -> None:
    made = registry.make(world, **options)
    for number, clips in enumerate((preference(made, left, right), guidance(made, left[0], right[0])), 1):
        kind = "preference" if number == 1 else "guidance"
        path = posted(db, world, kind, clips, 6 if number == 1 else 1, words="guide")
        assert english(client, path) == []
        assert english(client, path.replace("parent?", "parent/grid?")) == []


def test_english_is_said_to_whom_asks_for_nothing_else(client: httpx2.Client, db: Database) -> None:
    """The control: the same page in English is full of what the other tests look for."""
    lived(db)
    assert len(english(client, "/runs/1/parent?query=5", "en-GB,de;q=0.5")) > 40
    page = client.get("/runs/1/parent?query=5").text
    assert '<html lang="en" dir="ltr">' in page


def visible(page: Page) -> list[str]:
    """Return what is in English among all that is seen or said on a page."""
    return Texts(page.content()).english


def cut_off(page: Page) -> list[str]:
    """Return the texts that do not fit where they stand, and whether the page is too wide."""
    script = """all => all.filter(part => {
        const style = getComputedStyle(part), box = part.getBoundingClientRect();
        if (!box.width || part.closest('.sr, .where, .scene, svg') || style.clipPath !== 'none') return false;
        const hides = style.display !== 'inline' && style.overflowX !== 'visible';
        const off = box.right > innerWidth + 1 || box.left < -1;
        return off || hides && part.scrollWidth > part.clientWidth + 1;
    }).map(part => part.outerHTML.slice(0, 80))"""
    found: list[str] = page.locator("body *:visible").evaluate_all(script)
    wide = page.evaluate("document.documentElement.scrollWidth - innerWidth")
    return [*found, *([f"{wide} px too wide"] if wide > 0 else [])]


@pytest.mark.slow
@pytest.mark.parametrize("tag", ["de", "ar"])
def test_longer_sentences_fit_a_small_screen_in_both_directions(
    tabs: BrowserTabs, db: Database, tag: str
) -> None:
    """The sentences of scripts are looked at, too: answers, undo, waiting."""
    tabs.expected = ("404",)
    lived(db)
    page = tabs.open("/runs/1/parent?query=5", viewport=PHONE, locale=tag)
    expect(page.locator("html")).to_have_attribute("dir", "rtl" if tag == "ar" else "ltr")
    expect(page.locator("#question[data-listening]")).to_be_visible()
    found = {"question": cut_off(page) + visible(page)}
    page.keyboard.press("?")
    expect(page.locator("#help")).to_be_visible()  # its words come when they are first asked for
    found["help"] = cut_off(page) + visible(page)
    page.keyboard.press("Escape")
    expect(page.locator("#help")).to_be_hidden()
    page.keyboard.press("e")
    expect(page.locator("#waiting")).to_be_visible()
    found["waiting"] = cut_off(page) + visible(page)
    page.keyboard.press("z")
    expect(page.locator("#question")).to_be_visible()
    found["undone"] = cut_off(page) + visible(page)
    for path in ("/runs/1/history", "/runs/1/end", "/runs/9/parent", "/practice", "/practice?at=6"):
        page.goto(tabs.address + path)
        found[path] = cut_off(page) + visible(page)
    assert {where: texts for where, texts in found.items() if texts} == {}


@pytest.mark.slow
def test_the_board_is_not_mirrored(tabs: BrowserTabs, db: Database) -> None:
    """The left clip is on the left, and so is its button; words go from right to left."""
    _, mine = fixtures.start_run(db)
    fixtures.ask(db, mine, 1, "preference", fixtures.preference("down left", "right down"))
    page = tabs.open("/runs/1/parent?query=1", locale="ar", viewport={"width": 1280, "height": 800})
    for parts in (".card", ".answers button[data-way]"):
        left, right = (page.locator(parts).nth(number).bounding_box() for number in (0, 1))
        assert left is not None
        assert right is not None
        assert left["x"] < right["x"]
    direction = "part => getComputedStyle(part).direction"
    assert page.locator(".card .does").first.evaluate(direction) == "rtl"
    assert page.locator("h1").first.evaluate(direction) == "rtl"
    page.keyboard.press("g")
    expect(page.locator("[role=gridcell]:focus")).to_be_visible()
    cell = page.locator("[role=gridcell]:focus").bounding_box()
    agent = page.locator(".card").first.locator(".agent").bounding_box()
    assert cell is not None
    assert agent is not None
    assert abs(cell["x"] + cell["width"] / 2 - agent["x"] - agent["width"] / 2) < cell["width"] / 4
