"""The time that a person waits: from an answer to its tick, and from a key to the next question.

    python -m benchmarks.answers            50 answers of each kind, about ten minutes; needs Chromium
    python -m benchmarks.answers --quick    8 of each, about two minutes

`parenting up` serves a database in a temporary folder, and every figure is measured from outside, in
milliseconds:

- *applied*: an answer is sent, until its row holds the tick that heard it. HTTP, database and worker.
- *next stored*: the same, until the agent's next question is in the database.
- *ahead*: a key is pressed in headless Chromium, until the next question is on the screen, where the page has
  fetched it ahead: a run that asks preferences (preset direct, which compares pairs again, so that it never
  runs out of questions) and may have some of them open.
- *live*: the same where nothing is open: the answer goes to the database and to the worker, the agent acts on
  it and trains on it, asks for guidance again (preset conservative), and the page shows that. Presses after
  which a preference came count as well, and those after which the agent first took some steps alone.
- *started*: the button *Start* of the first page is pressed, until the first question is on the screen. The
  run is made, a worker begins it and acts until it asks; nothing of the page is in the browser's cache.

A key counts from the event's own time stamp. *On the screen* is when the browser presented the question's
heading (Element Timing); *painted* is when the page's own part of that frame was done. Between two keys lies
a random pause, as a person takes it.

Yardsticks from the same run say what the machine does: an empty request, a durable commit of one row, and a
key until a letter is on an empty page. On a machine with other work compare ratios to them: the last column
has each median in empty requests.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import httpx2
from playwright.sync_api import Browser, Page

from benchmarks.in_page import AHEAD, DONE, EMPTY, PROBE, SINCE, STARTED
from parenting.server.store.sqlite import PRAGMAS, sqlite_module
from tests.access import cookies_in
from tests.simulated_person import chromium, up

WORLDS = ("unsafe-exploration", "side-effects")
"""Without pre-training, and with it, so that the agent also rehearses mazes."""
ANSWERS, QUICK_ANSWERS = 50, 8
THINKS, PAUSES = (0.4, 2.0), (0.2, 0.5)
"""Seconds that a person looks at a question, and a script."""
SETTLES = 0.3
"""Seconds for which nobody asks the page anything after a key."""
PATIENCE = 20.0
IDLE = 0.7
"""A machine with a higher load average is not idle."""
SEED = 3
CLIENT = "benchmark"
HEAD = f"{'':23}{'world':20}{'n':>4}{'median':>9}{'p95':>9}{'min':>9}{'max':>9}{'requests':>10}"


class Line(NamedTuple):
    """Measurements of one kind in one world, in milliseconds."""

    kind: str
    world: str
    times: list[float]

    def __str__(self) -> str:
        """A row of the table."""
        told = "".join(f"{number:9.1f}" for number in self.numbers().values())
        return f"{self.kind:23}{self.world:20}{len(self.times):4}{told}"

    def numbers(self) -> dict[str, float]:
        """Median, 95th percentile (the nearest rank), least and most."""
        ranked = sorted(self.times)
        rank = -(-95 * len(ranked) // 100) - 1
        return {"median": median(ranked), "p95": ranked[rank], "min": ranked[0], "max": ranked[-1]}


# Without a browser


def request_and_commit(web: httpx2.Client, data: Path, times: int) -> Iterator[Line]:
    """Measure an empty request and a durable commit of a row."""
    yield Line("an empty request", "", timed(lambda: web.get("/healthz"), times))
    store = sqlite_module().connect(data / "yardstick.db", isolation_level=None)
    for name, value in PRAGMAS.items():
        store.execute(f"PRAGMA {name}={value}").fetchall()
    store.execute("CREATE TABLE line (word)")
    yield Line("a durable commit", "", timed(lambda: store.execute("INSERT INTO line VALUES ('a')"), times))
    store.close()


def timed(act: Callable[[], object], times: int) -> list[float]:
    """Milliseconds that each call takes, with a pause before it."""
    found = []
    for _ in range(times):
        time.sleep(0.1)
        began = time.perf_counter()
        act()
        found.append(1e3 * (time.perf_counter() - began))
    return found


def begin(web: httpx2.Client, world: str, preset: str, **config: float | bool) -> int:
    """A run that waits for a person: its number."""
    body = {"world": world, "preset": preset, "seed": SEED, "config": config}
    reply = web.post("/api/v1/runs", json=body)
    reply.raise_for_status()
    return int(reply.json()["id"])


def applied(web: httpx2.Client, data: Path, world: str, answers: int) -> Iterator[Line]:
    """Give guidance over HTTP; see in the database when each answer is heard, and the next question asked."""
    run = begin(web, world, "conservative", p_pref=0.0)
    store = sqlite_module().connect(f"file:{data / 'parenting.db'}?mode=ro", uri=True, isolation_level=None)
    draws = random.Random(SEED)
    times = [answer(web, store, run, draws) for _ in range(answers)]
    store.close()
    web.post(f"/api/v1/runs/{run}/stop").raise_for_status()
    yield Line("applied", world, [heard for heard, _ in times])
    yield Line("next stored", world, [asked for _, asked in times])


def answer(web: httpx2.Client, store: Any, run: int, draws: random.Random) -> tuple[float, float]:
    """One answer: milliseconds until it was heard, and until the next question was stored."""
    query = lease(web, run)
    time.sleep(draws.uniform(*PAUSES))

    def stored(rows: str, number: int) -> Callable[[], object]:
        return lambda: store.execute(f"SELECT 1 FROM {rows}", (number,)).fetchone()

    body = {"choice": draws.choice(("left", "right")), "client_id": CLIENT}
    began = time.perf_counter()
    web.post(f"/api/v1/queries/{query}/answer", json=body).raise_for_status()
    heard = until(stored("answer WHERE query_id = ? AND applied_tick IS NOT NULL", query))
    asked = until(stored("query WHERE run_id = ? AND status = 'open'", run))
    return 1e3 * (heard - began), 1e3 * (asked - began)


def lease(web: httpx2.Client, run: int) -> int:
    """The next question's number."""
    end = time.perf_counter() + PATIENCE
    while time.perf_counter() < end:
        reply = web.post(f"/api/v1/runs/{run}/queries/lease", json={"client_id": CLIENT})
        if reply.status_code == 200:
            return int(reply.json()["id"])
        time.sleep(0.02)
    raise TimeoutError(f"No question came within {PATIENCE:.0f} seconds.")


def until(holds: Callable[[], object], every: float = 0.0005) -> float:
    """Wait until something holds: when it did."""
    end = time.perf_counter() + PATIENCE
    while not holds():
        if time.perf_counter() > end:
            raise TimeoutError(f"It did not happen within {PATIENCE:.0f} seconds.")
        time.sleep(every)
    return time.perf_counter()


# With a browser


def empty_page(browser: Browser, times: int) -> Iterator[Line]:
    """Measure the time that the browser takes to paint one letter after a key."""
    page = browser.new_page()
    page.add_init_script(PROBE)
    page.goto("data:text/html,<!doctype html><body></body>")
    page.evaluate(EMPTY)
    draws = random.Random(SEED)
    yield from screens("a letter", "", [press(page, draws.uniform(0.1, 0.2), "a") for _ in range(times)])
    page.close()


def keys(
    browser: Browser, web: httpx2.Client, data: Path, world: str, ahead: bool, answers: int
) -> Iterator[Line]:
    """Answer a run by keys; count where the next question had been fetched ahead, or where it had not."""
    run = begin(web, world, "direct", recompare=True) if ahead else begin(web, world, "conservative")
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.context.add_cookies(cookies_in(data, str(web.base_url)))
    page.add_init_script(PROBE)
    page.goto(str(web.base_url.join(f"/runs/{run}/parent")))
    wanted = "#question[data-listening]" + ("[data-ahead]:not([data-ahead=''])" if ahead else "")
    draws, rows = random.Random(SEED), list[dict[str, Any]]()
    while len(rows) < answers:
        page.wait_for_selector(wanted, timeout=1e3 * PATIENCE)
        row = press(page, draws.uniform(*THINKS), draws.choice(("a", "b")))
        rows += [row] if bool(row["ahead"]) == ahead else []
    page.close()
    web.post(f"/api/v1/runs/{run}/stop").raise_for_status()
    yield from screens("ahead" if ahead else "live", world, rows)


def press(page: Page, pause: float, key: str) -> dict[str, Any]:
    """Think, press a key, and let the page tell what came of it."""
    page.wait_for_timeout(1e3 * pause)
    before = page.evaluate(f"({{ count: rows.length, ahead: {AHEAD} }})")
    page.wait_for_timeout(50)  # the page has forgotten that it was asked
    page.keyboard.press(key)
    page.wait_for_timeout(1e3 * SETTLES)
    until(lambda: page.evaluate(DONE, before["count"]), every=0.05)
    return {**page.evaluate("at => rows[at]", before["count"]), "ahead": before["ahead"]}


def starts(browser: Browser, web: httpx2.Client, data: Path, world: str, times: int) -> Iterator[Line]:
    """Press Start on the first page, each time in a browser that knows nothing of it."""
    painted, screen = list[float](), list[float]()
    for seed in range(times):
        context = browser.new_context(viewport={"width": 1280, "height": 800})
        context.add_cookies(cookies_in(data, str(web.base_url)))
        page = context.new_page()
        page.add_init_script(PROBE)
        page.add_init_script(STARTED)
        page.goto(str(web.base_url))
        page.select_option("#world", world)
        page.fill("form.fields input[name=seed]", str(seed))
        page.click("form.fields button.primary")
        page.wait_for_url("**/parent", timeout=1e3 * PATIENCE)
        until(lambda: page.evaluate(DONE, 0), every=0.05)  # noqa: B023 (called before the next round)
        for found, since in zip((painted, screen), page.evaluate(SINCE), strict=True):
            found.append(since)
        web.post(f"/api/v1/runs/{page.get_attribute('#main', 'data-run')}/stop").raise_for_status()
        context.close()
    yield Line("started, painted", world, painted)
    yield Line("started, on the screen", world, screen)


def screens(kind: str, world: str, rows: Sequence[dict[str, Any]]) -> Iterator[Line]:
    """Both times of some presses."""
    yield Line(f"{kind}, painted", world, [row["painted"] for row in rows])
    yield Line(f"{kind}, on the screen", world, [row["screen"] for row in rows])


def measure(worlds: Sequence[str], answers: int) -> Iterator[Line]:
    """Everything, one after the other: nothing else runs meanwhile."""
    path = os.environ.get("PARENTING_CHROMIUM") or shutil.which("chromium") or "chromium"
    with tempfile.TemporaryDirectory() as folder, up(data := Path(folder)) as url:
        web = httpx2.Client(base_url=url, timeout=PATIENCE)
        time.sleep(3)  # both processes have loaded what they need
        yield from request_and_commit(web, data, answers)
        for world in worlds:
            yield from applied(web, data, world, answers)
        with chromium(path) as browser:
            yield from empty_page(browser, answers)
            for ahead in (True, False):
                for world in worlds:
                    yield from keys(browser, web, data, world, ahead, answers)
            for world in worlds:
                yield from starts(browser, web, data, world, answers)
        web.close()


def main() -> None:
    """Print a table, or the same as JSON."""
    parser = argparse.ArgumentParser(description="Milliseconds from an answer to what comes of it.")
    parser.add_argument("--answers", type=int, default=ANSWERS, help=f"of each kind [default: {ANSWERS}]")
    parser.add_argument("--world", action="append", help=f"repeatable [default: {' and '.join(WORLDS)}]")
    parser.add_argument("--quick", action="store_true", help=f"{QUICK_ANSWERS} answers of each kind")
    parser.add_argument("--json", action="store_true", help="print JSON, with every single time")
    said = parser.parse_args()
    load = os.getloadavg()[0]
    lines = measure(said.world or WORLDS, QUICK_ANSWERS if said.quick else said.answers)
    if said.json:
        rows = [{**line._asdict(), **line.numbers()} for line in lines]
        print(json.dumps({"load": load, "cores": os.cpu_count(), "lines": rows}, indent=1))
        return
    idle = "" if load <= IDLE else ": NOT idle, so compare ratios to the yardsticks"
    print(f"{os.cpu_count()} cores, load average {load:.2f} at the start{idle}\n\n{HEAD}")
    request = None
    for line in lines:
        request = request or line.numbers()["median"]  # the first line is the empty request
        print(f"{line}{line.numbers()['median'] / request:10.1f}", flush=True)


if __name__ == "__main__":
    main()
