"""Draws the pictures of the documentation: `make pictures`. Needs Chromium."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Browser, Page

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.by_hand import answer, chromium, distances, start, up

FOLDER = Path(__file__).parent / "pictures"
DESKTOP, PHONE = {"width": 1280, "height": 800}, {"width": 390, "height": 844}
ANSWERS = 25


def shoot(browser: Browser, url: str, path: str, name: str, wait: str, folder: Path) -> None:
    """One page on a desktop and on a phone, light and dark."""
    for device, size in (("desktop", DESKTOP), ("phone", PHONE)):
        for scheme in ("light", "dark"):
            page = browser.new_page(viewport=size, color_scheme=scheme, reduced_motion="reduce")  # type: ignore[arg-type]
            page.goto(url + path)
            page.wait_for_selector(wait)
            page.wait_for_timeout(700)
            page.screenshot(path=folder / f"{name}-{device}-{scheme}.png", full_page=name != "parent")
            page.close()


def raise_a_little(page: Page, url: str) -> None:
    """Answer so many questions that the dashboard has something to show."""
    start(page, url, seed=3)
    to_goal = distances()
    for _ in range(ANSWERS):
        answer(page, to_goal)


def main(folder: Path) -> None:
    """All pictures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    path = os.environ.get("PARENTING_CHROMIUM") or shutil.which("chromium") or "chromium"
    with tempfile.TemporaryDirectory() as data, up(Path(data)) as url, chromium(path) as browser:
        page = browser.new_page(viewport=DESKTOP)  # type: ignore[arg-type]
        raise_a_little(page, url)
        page.close()
        shoot(browser, url, "/runs/1", "dashboard", ".js-plotly-plot", folder)
        shoot(browser, url, "/", "runs", "main", folder)
        start(fresh := browser.new_page(viewport=DESKTOP), url, seed=4)  # type: ignore[arg-type]
        fresh.wait_for_selector("#question")
        fresh.close()
        shoot_parent(browser, url, folder)


def shoot_parent(browser: Browser, url: str, folder: Path) -> None:
    """The parent's page with a question: a run for each picture, since a question goes to one browser."""
    for number, (device, size) in enumerate((("desktop", DESKTOP), ("phone", PHONE))):
        for scheme in ("light", "dark"):
            page = browser.new_page(viewport=size, color_scheme=scheme, reduced_motion="reduce")  # type: ignore[arg-type]
            start(page, url, seed=20 + number)
            to_goal = distances()
            for _ in range(6):
                answer(page, to_goal)
            page.wait_for_selector("#question")
            page.wait_for_timeout(700)
            page.screenshot(path=folder / f"parent-{device}-{scheme}.png")
            page.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
