"""The requests of a browser, as it tells of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from playwright.sync_api import BrowserContext, Page, Request

from tests.pages.browser_tabs import BrowserTabs, until


@dataclass
class Traffic:
    """The requests of a browser: all that were sent, and those that are open."""

    sent: list[str] = field(default_factory=list)
    open: set[Request] = field(default_factory=set)

    def watch(self, context: BrowserContext) -> None:
        context.on("request", self._begun)
        context.on("requestfinished", self._ended)
        context.on("requestfailed", self._ended)

    def _begun(self, request: Request) -> None:
        self.sent.append(f"{request.method} {request.url.split('/', 3)[3]}")
        self.open.add(request)

    def _ended(self, request: Request) -> None:
        self.open.discard(request)

    def lying(self) -> list[str]:
        """Return what is open; a page that was closed tells of no end."""
        here = (request for request in self.open if not request.frame.page.is_closed())
        return sorted(request.url.partition("?")[0].split("/")[-1] for request in here)


def seen(page: Page, holds: Callable[[], bool]) -> None:
    """Wait until something holds that the browser tells."""

    def looked() -> bool:
        page.wait_for_timeout(20)  # Playwright tells of requests while it is called
        return holds()

    until(looked)


def opened(tabs: BrowserTabs, paths: list[str], script: str = "") -> tuple[list[Page], Traffic]:
    """Pages of one browser."""
    first = tabs.open("/healthz")
    traffic = Traffic()
    traffic.watch(first.context)
    if script:
        first.context.add_init_script(script)
    pages = [first, *(first.context.new_page() for _ in paths[1:])]
    for page, path in zip(pages, paths, strict=True):
        page.goto(tabs.address + path)
    return pages, traffic
