"""The page that says why a question was asked, and what its answers changed."""

from __future__ import annotations

import re
from typing import Any

import httpx2
import pytest
from playwright.sync_api import expect
from sqlalchemy import select

from parenting.server.db import Database
from parenting.server.queue import answers, revisions, worker_side
from parenting.server.runs import Claim, get_run
from parenting.server.tables import Answer, Effect, Query, Reason
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs, given, until
from tests.pages.parent_page import address, shown

CHANCES = [0.1, 0.2, 0.3, 0.4]
GUIDANCE: dict[str, Any] = {
    "pausing": True,
    "familiarity": 2,
    "p_guid": 0.5,
    "chance": 0.25,
    "draw": 0.125,
    "probabilities": CHANCES,
}
PREFERENCE: dict[str, Any] = {
    "p_pref": 0.3,
    "draw": 0.2,
    "probabilities": CHANCES,
    "clips": {
        "left": {"kind": "exploratory", "first": 7, "last": 8},
        "right": {"kind": "exploitative", "first": 3, "last": 3},
    },
}


@pytest.fixture
def mine(db: Database) -> Claim:
    return fixtures.start_run(db)[1]


def keep(db: Database, mine: Claim, tick: int, why: dict[str, Any]) -> None:
    with db.write() as session:
        session.add(Reason(run_id=mine.run_id, tick=tick, why=why))


def changed(db: Database, mine: Claim, heard: int, *by_ticks: tuple[int, list[float]]) -> None:
    with db.write() as session:
        for ticks, there in by_ticks:
            policy = {"probabilities": there}
            session.add(Effect(run_id=mine.run_id, tick=heard, ticks=ticks, policy=policy))


def read(client: httpx2.Client, query: int | None = None) -> str:
    """The page as it reads."""
    page = client.get("/runs/1/why" + (f"?query={query}" if query else ""), follow_redirects=True)
    assert page.status_code == 200, page.text
    return " ".join(re.sub(r"<style.*?</style>|<[^>]*>", " ", page.text).split())


def test_guidance_in_sentences_with_its_numbers(db: Database, client: httpx2.Client, mine: Claim) -> None:
    query = fixtures.ask(db, mine, 5, "guidance", fixtures.guidance("left", "up"))
    keep(db, mine, 5, GUIDANCE)
    answers.answer(db, query, "left", "me", "human")
    assert "The agent has not heard this answer." in read(client, query)
    worker_side.take_answer(db, mine, 6)
    assert "is being measured" in read(client, query)
    changed(db, mine, 6, (0, CHANCES), (1, CHANCES[::-1]))
    page = read(client, query)
    for said in (
        "It had asked 2 times in these surroundings before",
        "= 0.5 2 = 0.25",
        "The draw was 0.125 , which is below it",
        "Answer 1: A, left, is better",
        "before it was heard as tick 6 began 10.0 % 20.0 % 30.0 % 40.0 %",
        "1 tick after after tick 6 40.0 % 30.0 % 20.0 % 10.0 %",
        "100 ticks after after tick 105 not lived yet",
    ):
        assert said in page, (said, page)


def test_an_asking_that_no_draw_decided_says_so(db: Database, client: httpx2.Client, mine: Claim) -> None:
    query = fixtures.ask(db, mine, 5, "guidance", fixtures.guidance("left", "up"))
    keep(db, mine, 5, {**GUIDANCE, "pausing": False, "draw": 0.9})
    page = read(client, query)
    assert "It had paused already" in page
    assert "The draw was" not in page
    assert "It has not been answered yet." in page


def test_a_preference_names_its_recordings(db: Database, client: httpx2.Client, mine: Claim) -> None:
    fixtures.ask(db, mine, 9, "preference", fixtures.preference("left left", "down"))
    keep(db, mine, 9, PREFERENCE)
    page = read(client)
    assert "left, an exploratory one, of ticks 7 to 8; right, an exploitative one, of tick 3." in page
    assert "= 0.3 . The draw was 0.2 ," in page


def test_an_old_question_says_what_was_not_recorded(db: Database, client: httpx2.Client, mine: Claim) -> None:
    query = fixtures.ask(db, mine, 5, "guidance", fixtures.guidance("left", "up"))
    answers.answer(db, query, "left", "me", "human")
    worker_side.take_answer(db, mine, 6)
    revisions.supersede(db, query, "right", "me", "human")
    page = read(client, query)
    for said in (
        "were not recorded when this was asked",
        "Which policy asked was not recorded.",
        "when it was first shown was not recorded",
        "What this answer changed was not recorded then.",
        "stands no more",
    ):
        assert said in page, said
    assert "played" not in page, "guidance has no clips"


def test_the_dashboard_and_the_history_lead_there(db: Database, client: httpx2.Client, mine: Claim) -> None:
    assert "This agent has not asked anything yet." in read(client)
    first = fixtures.ask(db, mine, 5, "guidance", fixtures.guidance("left", "up"))
    answers.answer(db, first, "left", "me", "human")
    fixtures.ask(db, mine, 9, "preference", fixtures.preference("left left", "down"))
    with db.read() as session:
        named = {row.tick: row.public_id for row in session.scalars(select(Query))}
    here = f"/runs/{get_run(db, 1).public_id}/why"
    assert f'href="{here}"' in client.get("/runs/1", follow_redirects=True).text
    assert f'href="{here}?query={named[5]}"' in client.get("/runs/1/history", follow_redirects=True).text
    assert f'href="{here}?query={named[5]}">Question before' in client.get(here).text
    assert f'href="{here}?query={named[9]}">Question after' in client.get(f"{here}?query={named[5]}").text
    assert client.get("/runs/1/why?query=77", follow_redirects=True).status_code == 404


@pytest.mark.slow
def test_how_often_the_clips_were_played_again_comes_with_the_answer(
    tabs: BrowserTabs, db: Database, mine: Claim
) -> None:
    query = fixtures.ask(db, mine, 9, "preference", fixtures.preference("left left", "down"))
    page = tabs.open("/runs/1/parent")
    shown(page, query)
    page.keyboard.press("Space")
    page.locator("#question [data-replay]").click()
    page.keyboard.press("e")
    until(lambda: len(given(db)) == 1)
    with db.read() as session:
        assert session.scalars(select(Answer.replays)).all() == [2]
    expect(page.locator("#saved")).to_have_text("Saved")  # nothing is on its way that would come back later
    page.goto(f"{tabs.address}{address(db, query=query)}&change=true")
    page.wait_for_selector("#question[data-listening]")
    page.keyboard.press("Space")
    page.keyboard.press("b")  # another answer, for which they were played once more
    until(lambda: len(given(db)) == 2)
    expect(page.locator("#saved")).to_have_text("Saved")
    page.goto(f"{tabs.address}/runs/1/why")
    first, second = page.locator(".given").all()
    expect(first).to_contain_text("The clips were played again 2 times.")
    expect(second).to_contain_text("The clips were played again 1 time.")
    page.get_by_role("button", name="Play", exact=True).click()
    assert page.evaluate("document.querySelector('.entry').getAnimations({ subtree: true }).length") > 0
