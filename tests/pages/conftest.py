"""A site with a database of its own: called by a test client, or served to a real browser."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import httpx2
import pytest
import uvicorn
from fastapi import FastAPI
from fastapi.testclient import TestClient
from playwright.sync_api import Browser, expect, sync_playwright

from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.listener import bind
from parenting.server.notify import Notifier
from parenting.server.progress import report_progress
from parenting.server.runs import Claim
from parenting.server.serve import Server
from parenting.server.settings import Settings
from tests.access import cookies
from tests.database import migrated
from tests.pages import island_fixtures as fixtures
from tests.pages.browser_tabs import BrowserTabs

expect.set_options(timeout=30_000)  # a busy machine is slow; what does not come, does not come then either

FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


@pytest.fixture(autouse=True)
def patient_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker gives its sign of life once in these tests; a slow machine must not make it a silent one."""
    monkeypatch.setattr("parenting.server.reads.schemas.SILENT_AFTER", timedelta(days=1))


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(data=tmp_path, database_url=None, listen_after_ms=0)


@pytest.fixture
def db(settings: Settings) -> Iterator[Database]:
    database = migrated(settings)
    yield database
    database.close()


@pytest.fixture
def client(site: FastAPI) -> Iterator[httpx2.Client]:
    with Reader(site, base_url="http://localhost", follow_redirects=False) as caller:
        yield caller


class Reader(TestClient):
    """A browser without scripts: the address of a page by a run's number leads to its public id.

    Where a form leads to is for each test to say.
    """

    def get(self, *arguments: Any, **named: Any) -> Any:
        return super().get(*arguments, **{"follow_redirects": True, **named})


@pytest.fixture
def site(settings: Settings, db: Database) -> FastAPI:
    return create_app(settings, db)


@pytest.fixture
def address(site: FastAPI, settings: Settings) -> Iterator[str]:
    """The site served at a free port, for a browser; requests wait longer, since machines stand still."""
    app = site
    app.state.admission.seconds = 60.0
    listener = bind(settings.model_copy(update={"port": 0}))
    server = Server(uvicorn.Config(app, log_config=None, timeout_graceful_shutdown=1))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    while not server.started:
        time.sleep(0.01)
    yield f"http://127.0.0.1:{listener.getsockname()[1]}"
    app.state.streams.close()
    server.should_exit = True
    thread.join()
    listener.close()


@pytest.fixture(scope="session")
def browser(chromium_path: str) -> Iterator[Browser]:
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=chromium_path, args=list(FLAGS))
        yield chromium
        chromium.close()


@pytest.fixture
def tabs(browser: Browser, address: str, db: Database) -> Iterator[BrowserTabs]:
    """Opens pages of the site; at the end nothing may have gone wrong in them."""
    found = BrowserTabs(browser, address, cookies(db, address))
    yield found
    found.close()
    assert found.wrong == []


@pytest.fixture
def mine(db: Database) -> Claim:
    return fixtures.start_run(db)[1]


@pytest.fixture
def ask(db: Database, mine: Claim, settings: Settings) -> Callable[..., int]:
    """Post a question as the worker does, and ring for the pages."""
    ticks = iter(range(1, 1000))

    def post(kind: str = "guidance", left: str = "left", right: str = "down", start: Any = (1, 2)) -> int:
        report_progress(db, mine, tick=0)  # a sign of life
        clips = {"guidance": fixtures.guidance, "preference": fixtures.preference}[kind](left, right, start)
        number = fixtures.ask(db, mine, next(ticks), kind, clips)
        Notifier(settings.data, "web").notify()
        return number

    return post
