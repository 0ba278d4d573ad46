"""Draws the pictures of the documentation: `make pictures`. Needs Chromium."""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import Browser, Page

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests import access
from tests.access import cookies_in
from tests.simulated_person import answer, chromium, create, distances, start, tell, until, up

FOLDER = Path(__file__).parents[1] / "docs" / "pictures"
SCREENS = {"desktop": (1280, 800), "phone": (390, 844)}
TALL = {"desktop": (1280, 1400), "phone": (390, 1400)}
ANSWERS, GOAL = 25, 50
COLOURS, TRUE = 256, 96
"""A picture of a page needs no more colours, and is a third as large. The most frequent are true to a bit."""

GARDEN = {"stages": 3, "mature_every": 15, "time_limit": 10}
"""A life in stages that is over within a minute or two."""


def shoot(page: Page, name: str, folder: Path, sizes: dict[str, tuple[int, int]] = SCREENS) -> None:
    """Take pictures of a page on a desktop and on a phone, which has no keys, light and dark."""
    for device, (width, height) in sizes.items():
        page.set_viewport_size({"width": width, "height": height})
        session = page.context.new_cdp_session(page)
        if device == "phone":
            session.send("Emulation.setTouchEmulationEnabled", {"enabled": True})
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
            page.wait_for_timeout(1500)
            drawn = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
            few_colours(drawn).save(folder / f"{name}-{device}-{scheme}.png", optimize=True)
        session.detach()
    page.reload()  # without it the page still takes itself for one on a touch screen


def few_colours(drawn: Image.Image) -> Image.Image:
    """A picture that looks the same: each colour becomes the nearest of the palette."""
    pixels = np.asarray(drawn).reshape(-1, 3)
    colours, which, counts = np.unique(pixels, axis=0, return_inverse=True, return_counts=True)
    others = drawn.quantize(COLOURS - TRUE, Image.Quantize.MAXCOVERAGE).getpalette() or []
    palette = np.concatenate(
        [colours[np.argsort(-counts)[:TRUE]], np.reshape(others, (-1, 3))[: COLOURS - TRUE]]
    )
    far = ((colours[:, None].astype(int) - palette[None].astype(int)) ** 2).sum(-1)
    few = Image.fromarray(far.argmin(1)[which].astype(np.uint8).reshape(drawn.height, drawn.width), "P")
    few.putpalette(palette.astype(np.uint8).tobytes())
    return few


class Visitors:
    """Browsers that are let in as the researcher, each with cookies of its own, and show no motion."""

    def __init__(self, browser: Browser, folder: Path, url: str) -> None:
        self.browser, self.folder, self.url = browser, folder, url

    def new_page(self) -> Page:
        """A page in a browser that has just come in."""
        context = self.browser.new_context(reduced_motion="reduce")
        context.add_cookies(cookies_in(self.folder, self.url))
        return context.new_page()


def raised(browser: Visitors, url: str) -> Page:
    """A parent's page after so many answers that dashboard and history have something to show."""
    page = browser.new_page()
    start(page, url, "conservative", seed=3, goal=GOAL)
    to_goal = distances()
    for _ in range(ANSWERS):
        answer(page, to_goal)
    page.wait_for_selector("#question[data-listening]")
    return page


def practised(browser: Visitors, url: str) -> Page:
    """The first question of the practice, answered."""
    page = browser.new_page()
    page.goto(f"{url}/practice")
    page.wait_for_selector("#question[data-listening]")
    page.keyboard.press("b")
    page.wait_for_selector(".again")
    page.wait_for_selector("#question[data-listening]")
    return page


def watched(page: Page) -> Page:
    """The walk of the present policy, over a question."""
    page.wait_for_selector("#question[data-listening]")
    page.keyboard.press("w")
    page.wait_for_selector("dialog.watch .walk")
    return page


def explained(page: Page, url: str) -> Page:
    """The page that says why one of the earlier questions was asked, ten answers ago."""
    page.goto(f"{url}/runs/2/history")
    page.locator(".why a").nth(10).click()
    page.wait_for_selector(".given table")
    return page


def compared(browser: Visitors, url: str) -> Page:
    """A parent's page that asks about two clips of three steps."""
    run = create(url, world="unsafe-exploration", preset="direct", config={"stages": 3}, seed=7)
    for _ in range(2):
        tell(url, run, "mature")
    page = browser.new_page()
    page.goto(f"{url}/runs/{run}/parent")
    steps = "[...document.querySelectorAll('#question .board')].map(b => b.dataset.actions.split(' ').length)"
    while page.wait_for_selector("#question[data-listening]") and page.evaluate(steps) != [3, 3]:
        answer(page, distances())
    return page


def painted(browser: Visitors, url: str) -> Page:
    """The editor of levels with a level whose goal is out of reach."""
    page = browser.new_page()
    page.goto(f"{url}/levels")
    page.locator("#begin").select_option("island-bottleneck")
    page.locator("#brushes label", has_text="water").click()
    page.locator("[data-at='3 3']").click()
    page.wait_for_selector("#beside:not([hidden])")
    return page


def beside(browser: Visitors, url: str, data: Path) -> Page:
    """Two batches with different presets, compared."""
    environment = {**os.environ, "PARENTING_DATA": str(data)}
    stored = []
    for preset in ("lax", "direct"):
        options = ["--preset", preset, "--trials", "8", "--store", "--json"]
        command = [sys.executable, "-m", "parenting.commands.main", "run", "unsafe-exploration", *options]
        said = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
        stored += json.loads(said.stdout)["runs"]
    page = browser.new_page()
    page.goto(f"{url}/compare?runs={','.join(map(str, stored))}")
    page.wait_for_selector("[data-chart=rows] .scatterlayer path", state="attached")
    return page


def main(folder: Path) -> None:
    """All pictures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    path = os.environ.get("PARENTING_CHROMIUM") or shutil.which("chromium") or "chromium"
    with tempfile.TemporaryDirectory() as data, up(Path(data)) as url, chromium(path) as chrome:
        access.use()
        browser = Visitors(chrome, Path(data), url)
        garden = create(
            url,
            world="reward-hacking",
            level="garden-mirrored",
            parent="scripted",
            config=GARDEN,
            goal=45,
            pace=4,
        )
        parent = raised(browser, url)
        shoot(parent, "parent", folder)
        shoot(watched(parent), "walk", folder)
        parent.keyboard.press("Escape")
        shoot(practised(browser, url), "practice", folder)
        shoot(compared(browser, url), "preference", folder)
        shoot(painted(browser, url), "levels", folder, TALL)
        shoot(beside(browser, url, Path(data)), "compare", folder, TALL)
        page = browser.new_page()
        page.goto(f"{url}/runs/{garden}")
        page.wait_for_selector("main[data-state=resting]", timeout=600_000)
        last = page.locator("#now-stage_queries")
        until(lambda: last.inner_text() == str(GARDEN["mature_every"]), 60, "the last answer was not counted")
        page.wait_for_selector("#seen-arrows path", state="attached")
        shoot(page, "dashboard", folder, TALL)
        page = parent.context.new_page()  # of the browser that has answered
        for name, address in (("history", "/runs/2/history"), ("runs", "/"), ("docs", "/docs")):
            page.goto(url + address)
            shoot(page, name, folder)
        shoot(explained(page, url), "why", folder, TALL)
        tell(url, 2, "goal", goal=ANSWERS)
        parent.reload()
        parent.wait_for_selector("main[data-state=resting]")
        shoot(parent, "resting", folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
