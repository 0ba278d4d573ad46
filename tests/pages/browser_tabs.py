"""Pages in a real browser, tabs: errors on the console and requests to other origins are written down."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, Request
from sqlalchemy import select

from parenting.server.db import Database
from parenting.server.tables import Answer

KEPT = """() => Object.entries(localStorage)
  .filter(([name]) => name === "parenting.answers" || name.startsWith("parenting.answer."))
  .flatMap(([, value]) => JSON.parse(value))"""


class BrowserTabs:
    """Opens pages of one site. `wrong` lists what went wrong in any of them."""

    def __init__(self, browser: Browser, address: str, cookies: Any) -> None:
        """`cookies` let the researcher in (`tests.access`)."""
        self.browser, self.address, self.cookies = browser, address, cookies
        self.wrong: list[str] = []
        self.expected: tuple[str, ...] = ()  # parts of messages that a test brings about on purpose
        self.contexts: list[BrowserContext] = []

    def open(self, path: str, **options: Any) -> Page:
        """A page in a context of its own (options: viewport, color_scheme, java_script_enabled, ...)."""
        context = self.browser.new_context(**options)
        self.contexts.append(context)
        context.add_cookies(self.cookies)
        page = context.new_page()
        page.set_default_timeout(30_000)
        page.on("console", self._heard)
        page.on("pageerror", lambda error: self.wrong.append(str(error)))
        page.on("request", self._asked)
        page.goto(self.address + path)
        return page

    def close(self) -> None:
        for context in self.contexts:
            for page in context.pages:
                page.unroute_all(behavior="ignoreErrors")  # what a test holds back ends with the page
            context.close()

    def _heard(self, message: ConsoleMessage) -> None:
        if message.type in ("error", "warning") and not any(part in message.text for part in self.expected):
            self.wrong.append(message.text)

    def _asked(self, request: Request) -> None:
        if not request.url.startswith((self.address, "data:", "blob:")):
            self.wrong.append(f"a request to {request.url}")


def given(db: Database) -> list[tuple[int, str]]:
    """The stored answers, in their order."""
    with db.read() as session:
        rows = session.scalars(select(Answer).order_by(Answer.number)).all()
        return [(row.query_id, row.choice) for row in rows]


def kept(page: Page) -> list[dict[str, Any]]:
    """The answers that the browser keeps."""
    found: list[dict[str, Any]] = page.evaluate(KEPT)
    return found


def until(holds: Callable[[], bool], seconds: float = 30.0) -> None:
    """Wait until something holds that no page shows."""
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.02)
