"""The page of what was answered."""

from __future__ import annotations

import re
from typing import Literal

import httpx2
import pytest
from playwright.sync_api import expect

from parenting.server.db import Database
from parenting.server.pages.history import PAGE
from parenting.server.persons import pseudonyms
from parenting.server.queue import answers, revisions, worker_side
from parenting.server.runs import Claim, get_run
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs
from tests.pages.parent_page import look
from tests.pages.test_access import violations

ME = "client-of-mine"


@pytest.fixture
def mine(db: Database) -> Claim:
    return fixtures.start_run(db)[1]


def answered(db: Database, mine: Claim, tick: int, choice: str, kind: str = "guidance", by: str = ME) -> int:
    """A question of this tick with its answer."""
    clips = {"guidance": fixtures.guidance, "preference": fixtures.preference}[kind]("left", "down")
    query = fixtures.ask(db, mine, tick, kind, clips)
    answers.answer(db, query, choice, by, "scripted" if by == "scripted" else "human")
    return query


def numbers(page: str) -> list[int]:
    return [int(number) for number in re.findall(r'id="answer-(\d+)"', page)]


def entry(page: str, number: int) -> str:
    """One answer as it reads."""
    text = page.partition(f'id="answer-{number}"')[2].partition("</li>")[0]
    return " ".join(re.sub("<[^>]*>", " ", text.partition(">")[2]).split())


def test_nothing_yet(client: httpx2.Client, mine: Claim) -> None:
    assert "Nothing has been answered yet." in client.get("/runs/1/history").text
    assert client.get("/runs/2/history").status_code == 404


def test_an_answer_with_all_that_is_known_of_it(client: httpx2.Client, db: Database, mine: Claim) -> None:
    answered(db, mine, 3, "left")
    worker_side.take_answer(db, mine, 4)
    answered(db, mine, 5, "neither", "preference", by="somebody-else")
    answered(db, mine, 6, "either", by="scripted")
    client.cookies.set("parenting_client", ME)
    page = client.get("/runs/1/history").text
    assert numbers(page) == [3, 2, 1]
    first = entry(page, 1)
    for part in (
        "A, left, is better",
        "guidance, stage T = 1",
        "at tick 3",
        "at tick 4",
        "you, in this browser",
    ):
        assert part in first
    assert "A Left: onto land better" in first
    assert "B Down: onto land" in first
    assert first.count("better") == 2, "in the heading, and at the move"
    second = entry(page, 2)
    assert "Both too dangerous" in second
    assert second.count("refused") == 2
    known = pseudonyms(db, ["somebody-else"])["somebody-else"]
    for part in ("preference", "Heard not yet", f"a person ({known})", "UTC"):
        assert part in second
    assert "somebody" not in page, "the name of a browser lets others answer as this person"
    third = entry(page, 3)
    assert "By a script" in third
    assert third.count("equal") == 2
    assert page.count('<svg class="board meeting"') == 2, "guidance has one board"
    assert page.count('<svg class="board"') == 6, "two clips, and a forecast of each of four moves"
    assert f'href="/api/v1/runs/{get_run(db, 1).public_id}/export"' in page


def test_guidance_of_a_run_with_two_boards_keeps_them(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db, guidance_layout="two")
    answered(db, mine, 3, "left")
    page = client.get("/runs/1/history").text
    assert "Left is better" in entry(page, 1)
    assert "Left better Left." in entry(page, 1)
    assert page.count('<svg class="board"') == 2
    assert "meeting" not in page


@pytest.mark.slow
def test_page_by_page(client: httpx2.Client, db: Database, mine: Claim) -> None:
    for tick in range(1, 2 * PAGE + 4):
        answered(db, mine, tick, "left")
    path, seen = "/runs/1/history", []
    while path:
        page = client.get(path).text
        seen.append(numbers(page))
        older = re.search(r'href="([^"]*)">Older answers', page)
        path = older[1].replace("&amp;", "&") if older else ""
    assert [len(part) for part in seen] == [PAGE, PAGE, 3]
    assert [number for part in seen for number in part] == list(range(2 * PAGE + 3, 0, -1))
    assert ">Newest</a>" in page
    assert "Newest" not in client.get("/runs/1/history").text


def test_some_of_them(client: httpx2.Client, db: Database, mine: Claim) -> None:
    for tick in range(1, PAGE + 5):
        answered(db, mine, tick, "left")
    answered(db, mine, 90, "right")
    answered(db, mine, 91, "left", "preference")
    right, clips = PAGE + 5, PAGE + 6
    assert numbers(client.get("/runs/1/history?choice=right&kind=").text) == [right]
    assert numbers(client.get("/runs/1/history?kind=preference").text) == [clips]
    page = client.get("/runs/1/history?kind=guidance&choice=left").text
    assert numbers(page) == list(range(PAGE + 4, 4, -1))
    assert '<option value="guidance" selected>guidance' in page
    here = f"/runs/{get_run(db, 1).public_id}/history"
    assert f'href="{here}?kind=guidance&amp;choice=left&amp;before=5"' in page
    assert "No answer matches." in client.get("/runs/1/history?choice=either").text
    for wrong in ("choice=best", "kind=none", "before=0", "before=x"):
        assert client.get(f"/runs/1/history?{wrong}").status_code == 422


def test_a_corrected_answer_says_so(client: httpx2.Client, db: Database, mine: Claim) -> None:
    query = answered(db, mine, 1, "left")
    revisions.supersede(db, query, "right", ME, "human")
    page = client.get("/runs/1/history").text
    assert "corrected later" in entry(page, 1)
    assert "corrected later" not in entry(page, 2)


@pytest.mark.slow
def test_a_corrected_answer_is_as_easy_to_read(tabs: BrowserTabs, db: Database, mine: Claim) -> None:
    for tick, kind in ((1, "guidance"), (2, "preference")):
        revisions.supersede(db, answered(db, mine, tick, "left", kind), "right", ME, "human")
    page = tabs.open("/runs/1/history")
    expect(page.locator(".superseded")).to_have_count(2)
    dim = "all => all.filter(part => getComputedStyle(part).opacity < 1).length"
    assert page.locator(".superseded, .superseded :not(svg *)").evaluate_all(dim) == 0
    schemes: list[Literal["light", "dark"]] = ["light", "dark"]
    for scheme in schemes:
        page.emulate_media(color_scheme=scheme)
        assert violations(page, runOnly=["color-contrast"]) == [], scheme


def test_dashboard_and_parents_page_lead_there(client: httpx2.Client, mine: Claim) -> None:
    link = re.search(r'href="(/runs/\w+/history)"', look(client).text)
    assert link is not None
    assert link[0] in client.get("/runs/1").text
    assert client.get(link[1]).text == client.get("/runs/1/history").text


def test_a_move_plays_while_its_arrow_or_its_button_is_pointed_at(tabs: BrowserTabs, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    answered(db, mine, 3, "left")
    page = tabs.open("/runs/1/history", viewport={"width": 1280, "height": 800})
    played = page.locator(".forecast.played")
    expect(page.get_by_role("button", name="Play A")).to_be_visible()
    expect(played).to_have_count(0)
    page.hover(".move.of-b .head")
    expect(played).to_have_attribute("data-side", "right")
    page.mouse.move(0, 0)
    expect(played).to_have_count(0)
    page.get_by_role("button", name="Play A").focus()
    expect(played).to_have_attribute("data-side", "left")
    page.evaluate("document.activeElement.blur()")
    expect(played).to_have_count(0)
