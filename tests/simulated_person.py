"""A person at the parent's page, played by a real browser: reads the page and presses keys."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx2
from playwright.sync_api import Browser, Page, sync_playwright

from parenting.envs import registry
from parenting.envs.levels.spec import Level
from tests.access import seed
from tests.server.serving import until_up

ROOT = Path(__file__).parents[1]
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
FAR = 1000
Cell = tuple[int, int]


@contextmanager
def up(data: Path) -> Iterator[str]:
    """`parenting up` with a database of its own, stopped by Ctrl-C: its URL."""
    seed(data)
    command = [sys.executable, "-m", "parenting.commands.main", "up", "--port", "0", "--no-browser"]
    environment = {**os.environ, "PARENTING_DATA": str(data), "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        found = re.search(r"http://\S+", process.stdout.readline())
        assert found
        try:
            # the address is told while the processes still start, which takes seconds where others work, too
            until_up(url := found[0].partition("/open?")[0], seconds=60)
            yield url
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(60)


@contextmanager
def chromium(path: str) -> Iterator[Browser]:
    """Debian's Chromium."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()


def create(url: str, **new: Any) -> int:
    """A new run, by the API: its id."""
    return int(httpx2.post(f"{url}/api/v1/runs", json=new).raise_for_status().json()["id"])


def tell(url: str, run: int, verb: str, **body: Any) -> None:
    """One of the operator's verbs, by the API."""
    httpx2.post(f"{url}/api/v1/runs/{run}/{verb}", json=body or None).raise_for_status()


def start(page: Page, url: str, preset: str, seed: int = 3, goal: int | None = None) -> None:
    """Fill in the form on the first page, as a person does, and begin."""
    page.goto(url)
    page.check(f"form.fields input[name=preset][value={preset}]")
    page.fill("form.fields input[name=seed]", str(seed))
    page.fill("form.fields input[name=goal]", "" if goal is None else str(goal))
    page.click("form.fields button.primary")
    page.wait_for_selector("#main[data-run]")


def distances(level: str | Level = "island", to: str = "G") -> dict[Cell, int]:
    """Steps to the goal or another glyph on dry land, as anyone sees them who looks at the drawing."""
    drawn = registry.level("unsafe-exploration", level) if isinstance(level, str) else level
    reached = {drawn.find(to)[0]: 0}
    edge = list(reached)
    while edge:
        y, x = edge.pop(0)
        for cell in ((y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)):
            if drawn.glyph(cell) not in "#W" and cell not in reached:
                reached[cell] = reached[(y, x)] + 1
                edge.append(cell)
    return reached


def answer(page: Page, to_goal: dict[Cell, int]) -> str:
    """Look at the question, press the key, wait until the page has moved on: the key."""
    form = page.wait_for_selector("#question[data-listening]")
    assert form
    query = form.get_attribute("data-query")
    left, right = (to_goal.get(_end(path), FAR) for path in _paths(page))
    if left == right == FAR:
        key = "n"
    elif left == right:
        key = "e"
    else:
        key = "a" if left < right else "b"
    page.keyboard.press(key)
    page.wait_for_selector(f'#question[data-query="{query}"]', state="detached", timeout=10_000)
    return key


def _paths(page: Page) -> list[str]:
    return [
        board.get_attribute("data-path") or ""
        for board in page.query_selector_all("#question .board .agent[data-path]")
    ]


def _end(path: str) -> Cell:
    x, y = (float(number) for number in path.split()[-1].split(","))
    return round((y - 10) / 20), round((x - 10) / 20)


def until(holds: object, seconds: float, what: str) -> None:
    """Wait for something that happens elsewhere."""
    end = time.monotonic() + seconds
    while not holds():  # type: ignore[operator]
        assert time.monotonic() < end, what
        time.sleep(0.02)
