"""One stream a browser: it brings what happens and the questions of all parent's pages; its reader may go."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial

import pytest
from fastapi import FastAPI
from playwright.sync_api import Error as PlaywrightError
from playwright.sync_api import Page, expect

from parenting.server.db import Database
from parenting.server.notify import Notifier
from parenting.server.progress import report_progress
from parenting.server.settings import Settings
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs, given, until
from tests.pages.parent_page import shown
from tests.pages.traffic import Traffic, opened, seen

STREAM = "/runs/parent/stream"


@pytest.fixture
def two(db: Database, settings: Settings) -> Callable[[int], int]:
    """Post a question of the first or the second run, as the worker does: its number."""
    mine = [fixtures.start_run(db)[1] for _ in range(2)]
    ticks = iter(range(1, 1000))

    def post(run: int) -> int:
        report_progress(db, mine[run - 1], tick=0)
        clips = fixtures.preference("down down", "left")
        number = fixtures.ask(db, mine[run - 1], next(ticks), "preference", clips)
        Notifier(settings.data, "web").notify()
        return number

    return post


def stored(db: Database, count: int) -> bool:
    return len(given(db)) == count


def test_questions_come_without_a_request_and_answers_alone_are_sent(
    tabs: BrowserTabs, db: Database, ask: Callable[..., int]
) -> None:
    numbers = [ask("preference", "down down", "left") for _ in range(2)]
    (page,), traffic = opened(tabs, ["/runs/1/parent"])
    seen(page, lambda: traffic.lying() == ["stream"])
    shown(page, numbers[0])
    expect(page.locator("#question:not([data-ahead=''])")).to_be_visible()
    traffic.sent.clear()
    for _ in range(4):
        shown(page, numbers[len(given(db))])
        answered = len(given(db)) + 1
        page.keyboard.press("a")
        until(partial(stored, db, answered))
        numbers.append(ask("preference", "down down", "left"))
    assert [one for one in traffic.sent if one.endswith(("/question", "/stream"))] == []
    assert [one for one in traffic.sent if one.startswith("GET api/")] == []
    seen(page, lambda: traffic.lying() == ["stream"])


@pytest.mark.slow
def test_pages_of_two_runs_share_one_stream_and_each_gets_its_own_questions(
    tabs: BrowserTabs, site: FastAPI, two: Callable[[int], int]
) -> None:
    pages, traffic = opened(tabs, ["/runs/1/parent", "/runs/2/parent"])
    numbers = [two(1), two(2)]
    for page, number in zip(pages, numbers, strict=True):
        shown(page, number)
    seen(pages[0], lambda: traffic.lying() == ["stream"])
    until(lambda: site.state.streams.number() == 2)  # a former one may still be ending


def crash(page: Page) -> None:
    with suppress(PlaywrightError):  # it does not come to its reply
        page.goto("chrome://crash", timeout=3000)


def freeze(page: Page) -> None:
    page.context.new_cdp_session(page).send("Page.setWebLifecycleState", {"state": "frozen"})


@pytest.mark.slow
@pytest.mark.parametrize("leave", [Page.close, freeze, crash])
def test_stream_is_handed_over_when_its_reader_is_gone(
    tabs: BrowserTabs, two: Callable[[int], int], leave: Callable[[Page], None]
) -> None:
    (reader, other), traffic = opened(tabs, ["/runs/1/parent", "/runs/2/parent"])
    seen(other, lambda: traffic.lying() == ["stream"])
    expect(other.get_by_role("heading", name="The agent is exploring")).to_be_visible()
    before = traffic.sent.count(f"POST {STREAM[1:]}")
    leave(reader)
    if leave is not freeze:  # its silence is noticed, and the other page asks by itself
        seen(other, lambda: traffic.sent.count(f"POST {STREAM[1:]}") > before)
    shown(other, two(2))
    if leave is Page.close:
        seen(other, lambda: traffic.lying() == ["stream"])


WITHOUT = {
    "SharedWorker": "delete globalThis.SharedWorker",
    "BroadcastChannel": "delete globalThis.BroadcastChannel",
    "locks": "Object.defineProperty(Navigator.prototype, 'locks', { value: undefined })",
    "storage": "Object.defineProperty(window, 'localStorage', { get() { throw new Error('none'); } })",
    "the stream": "0",
}


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("what", WITHOUT)
def test_pages_work_without(tabs: BrowserTabs, db: Database, two: Callable[[int], int], what: str) -> None:
    """A private window is like any other: what a browser withholds there is withheld here one by one."""
    tabs.expected = ("Failed to load resource",)
    first = tabs.open("/healthz")
    if what == "the stream":
        first.context.route(f"**{STREAM}", lambda route: route.abort())
    first.add_init_script(WITHOUT[what])
    traffic = Traffic()
    traffic.watch(first.context)
    first.goto(f"{tabs.address}/runs/1/parent")
    for count in range(2):
        number = two(1)
        shown(first, number)
        first.keyboard.press("a")
        until(partial(stored, db, count + 1))
    carried = ["stream"] if what in ("SharedWorker", "storage") else []
    seen(first, lambda: traffic.lying() == carried)
