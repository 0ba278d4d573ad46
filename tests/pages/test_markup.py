"""Rules that hold for every page and every file that it loads."""

from __future__ import annotations

import re
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path

import httpx2
import pytest

from parenting.server.db import Database
from parenting.server.pages.render import WEB
from parenting.server.pages.texts import STATE_TEXTS
from parenting.server.statuses import RunState
from tests.pages import island_fixtures as fixtures

PATHS = (
    "/",
    "/levels",
    "/practice?at=1&choice=left",
    "/practice?at=6",
    "/runs/1",
    "/runs/1/parent",
    "/runs/1/parent?query=1",
    "/runs/1/parent?query=2",
    "/runs/77",
)
STATIC = sorted((WEB / "static").iterdir())


class Tags(HTMLParser):
    """Every tag of a page with its attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))


@pytest.fixture(params=PATHS)
def tags(request: pytest.FixtureRequest, client: httpx2.Client, db: Database) -> Tags:
    _, mine = fixtures.start_run(db)
    fixtures.measure(db, mine, 30)
    fixtures.ask(db, mine, 31, "guidance", fixtures.guidance("left", "up", start=(1, 2)))
    fixtures.ask(db, mine, 32, "preference", fixtures.preference("down left left", "up down up down up down"))
    return Tags(client.get(request.param, follow_redirects=True).text)


def test_no_script_and_no_style_stands_in_a_page(tags: Tags) -> None:
    for tag, attributes in tags.found:
        assert tag != "style"
        assert "style" not in attributes
        assert not [name for name in attributes if name.startswith("on")]
        if tag == "script":
            assert str(attributes["src"]).startswith("/static/")


def test_everything_comes_from_here(tags: Tags) -> None:
    for _, attributes in tags.found:
        for name in ("src", "href", "action"):
            assert name not in attributes or str(attributes[name]).startswith(("/", "#"))


def test_ids_are_unique_and_labels_meet_their_fields(tags: Tags) -> None:
    ids = Counter(attributes["id"] for _, attributes in tags.found if "id" in attributes)
    assert not [name for name, count in ids.items() if count > 1]
    for _, attributes in tags.found:
        for name in ("for", "aria-labelledby"):
            assert name not in attributes or attributes[name] in ids
        for name in str(attributes.get("aria-describedby", "")).split():
            assert name in ids


def test_every_pattern_that_is_painted_is_there(tags: Tags) -> None:
    ids = {attributes.get("id") for _, attributes in tags.found}
    fills = {str(attributes.get("fill")) for _, attributes in tags.found}
    painted = {fill[5:-1] for fill in fills if fill.startswith("url(#")}
    assert painted <= ids


@pytest.mark.parametrize("path", STATIC, ids=lambda path: path.name)
def test_a_static_file_loads_nothing_from_elsewhere(path: Path) -> None:
    text = path.read_text().replace("http://www.w3.org/2000/svg", "")
    assert not re.findall(r"https?://|//[a-z]+\.[a-z]", text)


@pytest.mark.parametrize("path", STATIC, ids=lambda path: path.name)
def test_a_static_file_is_short(path: Path) -> None:
    assert len(path.read_text().splitlines()) <= 300


def test_script_and_server_know_the_same_states() -> None:
    """The state of a run comes from the server. A page adds what only it can know, and has words for each."""
    own = {"elsewhere", "taken", "unsent", "away", "offline", "refused", "damaged"}
    assert {*RunState} | own == set(STATE_TEXTS)
    parts = ("parent", "questions", "answers", "waiting")
    script = "".join((WEB / f"static/{part}.js").read_text() for part in parts)
    named = set(re.findall(r'wait\("(\w+)"\)|state = "(\w+)"|\? "(\w+)" : (?:"(\w+)")?', script))
    named = {name for names in named for name in names if name}
    assert own <= named <= set(STATE_TEXTS)
    assert not re.findall(r'"(over|resting|paused|no_worker|stuck)"', (WEB / "static/live.js").read_text())


def test_pages_are_not_kept_by_the_browser(client: httpx2.Client, db: Database) -> None:
    fixtures.start_run(db)
    for path in ("/", "/runs/1", "/runs/1/parent"):
        assert client.get(path, follow_redirects=True).headers["cache-control"] == "no-store"
