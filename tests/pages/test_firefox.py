"""The parent's page in Firefox: load, answer by key and click, undo, reload, two tabs. A smoke run."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from parenting.server.db import Database
from tests.access import opening
from tests.pages.browser_tabs import given, until
from tests.pages.firefox import Firefox, FirefoxTab, firefox
from tests.pages.parent_page import address as page_address
from tests.pages.parent_page import public_id


@pytest.fixture
def browser_of_mozilla(tmp_path: Path, address: str, db: Database) -> Iterator[Firefox]:
    """Firefox. Without one a laptop skips the test, and CI fails it."""
    program = os.environ.get("PARENTING_FIREFOX") or shutil.which("firefox-esr") or shutil.which("firefox")
    if program is None:
        reason = "no Firefox: install it (apt install firefox-esr) or name it in PARENTING_FIREFOX"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    with firefox(program, tmp_path, address) as running:
        tab = running.open(f"/open?token={opening(db)}")
        tab.wait("location.pathname === '/'")  # the page has sent its form by itself
        yield running
        assert running.wrong == []


def shown(tab: FirefoxTab, db: Database, query: int) -> None:
    """Wait until a question is on the page and takes an answer."""
    name = public_id(db, query)
    tab.wait(f"document.querySelector('#question[data-query=\"{name}\"][data-listening]')")


@pytest.mark.slow
def test_firefox_answers_takes_back_reloads_and_shares_two_tabs(
    browser_of_mozilla: Firefox, db: Database, ask: Callable[..., int]
) -> None:
    """It takes long because a browser starts."""
    first, second, third, fourth = ask(), ask(), ask("preference"), ask("preference")
    tab = browser_of_mozilla.open(page_address(db))
    shown(tab, db, first)
    tab.press("b")
    until(lambda: given(db) == [(first, "right")])
    shown(tab, db, second)
    tab.press("z")
    shown(tab, db, first)
    tab.click(".answers [value=neither]")
    until(lambda: given(db)[-1] == (first, "neither"))
    shown(tab, db, second)
    tab.click(".move.of-a .head")
    until(lambda: given(db)[-1] == (second, "left"))
    shown(tab, db, third)
    tab.reload()
    shown(tab, db, third)
    tab.wait("document.querySelector('#count').textContent === '2'")
    other = browser_of_mozilla.open(page_address(db))
    shown(other, db, third)
    other.press("e")
    until(lambda: given(db)[-1] == (third, "either"))
    shown(other, db, fourth)
    tab.activate()
    shown(tab, db, fourth)
    tab.wait("document.querySelector('#count').textContent === '3'")
    assert [choice for _, choice in given(db)] == ["right", "neither", "left", "either"]
    assert browser_of_mozilla.wrong == []
    tab.evaluate("console.error('planted')")  # the control: what goes wrong is heard
    tab.wait("true")
    assert browser_of_mozilla.wrong == ["planted"]
    browser_of_mozilla.wrong.clear()
