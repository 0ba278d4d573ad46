"""A program that reads Chromium's accessibility tree finds all that answers a question in its words."""

from __future__ import annotations

import json
import re

import httpx2
import pytest
from playwright.sync_api import Page, expect

from parenting.envs import registry
from parenting.server.db import Database
from tests.drawing.world_clips import guidance
from tests.pages.browser_tabs import BrowserTabs, given, until
from tests.pages.test_every_world_page import posted
from tests.told_board import ToldBoard, read_sentences

FIRST = re.compile(r"(Both end alike|By air) .*")
"""The first of the sentences on the board; before it stands the question."""


def heard(page: Page) -> ToldBoard:
    """The board that a screen reader is told of, read out of the accessibility tree alone."""
    expect(page.locator("#said")).to_contain_text("All else is land.")
    nodes = page.context.new_cdp_session(page).send("Accessibility.getFullAXTree")["nodes"]
    texts = [node["name"]["value"] for node in nodes if node["role"]["value"] == "StaticText"]
    (told,) = [text for text in texts if "The board reaches" in text]
    found = FIRST.search(told)
    assert found, told
    return read_sentences(re.split(r"(?<=\.) (?=[A-Z])", found[0].strip()), ("A", "B"))


@pytest.mark.slow_after(1)
@pytest.mark.parametrize(
    ("moves", "choice"), [("du", "left"), ("ud", "right"), ("dl", "either")], ids=["A", "B", "either"]
)
def test_the_words_in_the_tree_answer_the_question(
    tabs: BrowserTabs, db: Database, moves: str, choice: str
) -> None:
    clips = guidance(registry.make("unsafe-exploration"), *moves)
    page = tabs.open(posted(db, "unsafe-exploration", "guidance", clips, 1))
    expect(page.locator("#question[data-listening]")).to_be_visible()  # before, no key is heard
    told = heard(page)
    said = page.locator("#said")
    said.evaluate("said => { said.textContent = ''; }")
    page.keyboard.press("d")
    assert heard(page) == told
    page.keyboard.press({"left": "a", "right": "b", "either": "e"}[told.choice("guidance")])
    until(lambda: given(db) == [(1, choice)])


def test_the_board_in_words_opens_by_key_and_answers_nothing(tabs: BrowserTabs, db: Database) -> None:
    clips = guidance(registry.make("unsafe-exploration"), "d", "u")
    page = tabs.open(posted(db, "unsafe-exploration", "guidance", clips, 1))
    page.locator(".around summary").focus()
    page.keyboard.press("Space")
    expect(
        page.get_by_text("The goal is 3 down and 1 left of the agent, 4 cells by air.", exact=True)
    ).to_be_visible()
    assert given(db) == []


@pytest.mark.parametrize("words", ["plain", "guide"])
def test_safe_ways_are_told_where_the_run_says_so(client: httpx2.Client, db: Database, words: str) -> None:
    """On the page, by the API, and in the export, which says what was told."""
    clips = guidance(registry.make("unsafe-exploration"), "d", "r")
    page = client.get(posted(db, "unsafe-exploration", "guidance", clips, 1, words=words)).text
    leased = client.post("/api/v1/runs/1/queries/lease", json={"client_id": "me"}).json()
    told = "By a safe way: 3 steps after"
    assert (f"{told} A, 5 steps after B." in page) == (words == "guide")
    assert (f"{told} left, 5 steps after right." in leased["sentences"]) == (words == "guide")
    client.post(f"/api/v1/queries/{leased['id']}/answer", json={"choice": "left", "client_id": "me"})
    (line,) = client.get("/api/v1/runs/1/export").text.splitlines()
    assert json.loads(line)["words"] == words
    assert client.get("/api/v1/runs/1").json()["words"] == words


def test_the_form_offers_safe_ways_and_leaves_them_out_unless_chosen(client: httpx2.Client) -> None:
    form = {"world": "unsafe-exploration", "parent": "human", "preset": "conservative", "seed": "1"}
    for chosen in ({}, {"words": "guide"}):
        client.post("/runs", data={**form, **chosen})
    told = [client.get(f"/api/v1/runs/{run}").json()["words"] for run in (1, 2)]
    assert told == ["plain", "guide"]
    assert '<option value="guide">Also how long a safe way is</option>' in client.get("/").text
