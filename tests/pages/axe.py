"""axe's rules on a page. Its half a megabyte goes into a page once, and only what is violated comes back."""

from __future__ import annotations

from typing import Any

from axe_playwright_python.base import AXE_SCRIPT
from playwright.sync_api import Page

RUN = "options => axe.run(options).then(found => found.violations)"


def violated(page: Page, **options: Any) -> list[dict[str, Any]]:
    """The rules that a page violates; `options` choose among them."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE_SCRIPT)
    found: list[dict[str, Any]] = page.evaluate(RUN, {"resultTypes": ["violations"], **options})
    return found
