"""Watch it walk: the present policy plays an episode on the board, by a button, by W, and by a plain form."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterator
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Page, expect

from parenting.server import jobs, metrics
from parenting.server.db import Database, connect
from parenting.server.progress import report_progress
from parenting.server.queue.worker_side import high_water
from parenting.server.runs import Claim, get_run
from parenting.server.settings import Settings
from parenting.server.work.jobs import Jobs
from parenting.server.workers import sign
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs, until
from tests.pages.parent_page import address, shown
from tests.pages.test_access import light_and_dark


@pytest.fixture
def worker(db: Database, settings: Settings) -> Iterator[None]:
    """A worker that does jobs alone: nobody raises the runs of these tests."""
    own, told = connect(settings), threading.Event()
    some = Jobs(own, 5.0, lambda: None)

    def work() -> None:
        while not told.wait(0.05):
            some.news()
            some.begin("jobs alone")

    sign(db, "jobs alone")
    thread = threading.Thread(target=work)
    thread.start()
    yield
    told.set()
    thread.join()
    some.close(30)
    own.close()


def walk_of(db: Database) -> str:
    """The page of a walk that is done, by a worker that is not there."""
    run = get_run(db, 1)
    asked = jobs.ask(db, run.id, "walk", {"seed": 1}, "me")
    return f"/runs/{run.public_id}/walk/{asked.public_id}"


def test_a_plain_form_leads_to_a_page_that_waits_and_then_shows(
    client: httpx2.Client, db: Database, settings: Settings
) -> None:
    fixtures.start_run(db)
    run = get_run(db, 1).public_id
    asked = client.post(f"/runs/{run}/walk", data={"client_id": "client-of-mine"})
    assert asked.status_code == 303
    page = client.get(asked.headers["location"]).text
    assert "No worker is running" in page
    assert 'http-equiv="refresh"' in page
    sign(db, "a")
    assert "The agent gets ready." in client.get(asked.headers["location"]).text
    assert client.get(f"{asked.headers['location']}/board").status_code == 404
    some = Jobs(db, 5.0, lambda: None)
    some.begin("a")
    some.close(60)
    page = client.get(asked.headers["location"]).text
    assert 'http-equiv="refresh"' not in page
    assert re.search(r"It (reached the goal|went into the water) after|it was not at the goal", page)
    assert re.search(r'<path class="likely" d="M', page)
    assert re.search(r"<li>Row 2: column \d+ (up|down|left|right) \(\d+\xa0%\)", page)
    other = fixtures.start_run(db)[0]
    stray = asked.headers["location"].replace(run, other.public_id)
    assert client.get(stray).status_code == 404


def test_a_walk_that_failed_says_why(client: httpx2.Client, db: Database) -> None:
    fixtures.start_run(db)
    there = walk_of(db)
    (mine,) = jobs.claim(db, "a", 1)
    jobs.fail(db, mine, "The worker could not do this (walk): it was told so.")
    page = client.get(there).text
    assert "it was told so." in page
    assert "Another walk" in page


def dialog(page: Page) -> Any:
    return page.get_by_role("dialog", name="Watch it walk")


def test_w_lets_it_walk_over_a_question_which_stays_as_it_was(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int], mine: Claim, worker: None
) -> None:
    first = ask()
    before = high_water(db, mine.run_id)
    page = tabs.open(address(db))
    shown(page, first)
    page.keyboard.press("w")
    expect(dialog(page).locator(".walk.played .walked .board")).to_be_visible()
    expect(dialog(page).locator(".arrows path.likely")).to_have_count(1)
    expect(dialog(page).locator(".state")).to_have_text(re.compile(r"steps? (was|were) unsafe\."))
    moved = dialog(page).locator(".walked .agent")
    start = moved.evaluate("agent => getComputedStyle(agent).transform")
    until(lambda: moved.evaluate("agent => getComputedStyle(agent).transform") != start)
    assert light_and_dark(page) == []
    for key in ("a", "e", "z"):
        page.keyboard.press(key)  # nothing is answered beneath
    page.keyboard.press("Escape")
    expect(dialog(page)).to_be_hidden()
    shown(page, first)
    run = get_run(db, mine.run_id)
    assert (run.answers, high_water(db, mine.run_id)) == (0, before)
    page.keyboard.press("a")
    expect(page.locator("#count")).to_have_text("1")


@pytest.mark.slow
def test_the_waiting_page_shows_growth_a_walk_and_a_milestone_once(
    tabs: BrowserTabs, db: Database, mine: Claim, ask: Callable[..., int], worker: None
) -> None:
    for tick, safe in ((1, 2), (2, 9)):
        row = {"guidance": tick, "preference": 0, "cells": 12, "safe_cells": safe, "maturity": 1}
        metrics.write_metrics(db, mine, {tick: row})
    page = tabs.open(address(db))
    shown(page, ask())
    page.keyboard.press("a")
    lesson = {
        "tick": 2,
        "kind": "guidance",
        "cell": [1, 2],
        "before": [0.25] * 4,
        "after": [0.1, 0.1, 0.7, 0.1],
    }
    report_progress(db, mine, tick=3, milestones={"goal": 2}, lesson=lesson)
    expect(page.locator(".news")).to_have_text("It reached the goal for the first time.")
    growth = page.locator("#waiting .growth")
    expect(growth).to_contain_text("After 2 answers it reaches the goal safely from 75 % of 12 cells.")
    expect(growth).to_contain_text(
        "The last answer changed what it would do in the cell of the question: up 25 % → 10 %, "
        "down 25 % → 10 %, left 25 % → 70 %, right 25 % → 10 %."
    )
    expect(page.locator(".beside .lesson")).to_be_hidden()  # it is told once
    assert light_and_dark(page) == []
    page.get_by_role("button", name="Watch it walk").click()
    expect(dialog(page).locator(".walk.played")).to_be_visible()
    second = ask()
    expect(dialog(page).locator(".waits")).to_have_text("A question is waiting.")
    dialog(page).get_by_role("button", name="Close").click()
    shown(page, second)
    expect(page.locator(".beside .lesson")).to_be_visible()
    expect(page.locator(".beside .lesson")).to_contain_text("The last answer changed: up 25 % → 10 %, down")
    page.reload()
    shown(page, second)
    page.keyboard.press("b")
    expect(growth).to_be_visible()
    expect(page.locator(".news")).to_have_text("")


@pytest.mark.slow
def test_without_a_worker_the_dialog_says_so_and_walks_once_there_is_one(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    page = tabs.open(address(db))
    shown(page, ask())
    page.get_by_role("button", name="Watch it walk").click()
    expect(dialog(page).locator(".state")).to_contain_text("No worker is running")
    some = Jobs(db, 5.0, lambda: None)
    some.begin("late")
    some.close(60)
    expect(dialog(page).locator(".walk.played")).to_be_visible()


@pytest.mark.slow
def test_what_did_not_come_without_a_connection_comes_later(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    tabs.expected = ("net::ERR_INTERNET_DISCONNECTED",)
    page = tabs.open(address(db))
    shown(page, ask())
    page.context.set_offline(True)
    page.keyboard.press("w")
    expect(page.locator("#alert")).to_have_text("The walk cannot be loaded now. Try again.")
    expect(page.locator("link[href*=walk]")).to_have_count(0)
    page.context.set_offline(False)
    page.keyboard.press("w")
    expect(dialog(page)).to_be_visible()
    expect(page.locator("#alert")).to_be_empty()
    assert page.locator("link[href*=walk]").evaluate("link => link.sheet.cssRules.length > 0")
