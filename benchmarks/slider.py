"""The board of a long life in Chromium: bytes stored, seconds and memory while its slider is moved.

    python -m benchmarks.slider                  20,000 ticks on the island
    python -m benchmarks.slider --answers 500    a life of five hundred answers
    python -m benchmarks.slider --world reward-hacking --ticks 2000

A life is lived in this process, with a scripted parent, and stored as a worker stores it. It is then served
by `parenting web`. *shown* counts from the second click on the dashboard's address to the board with its
newest snapshot; *a step* is the time from a key on the slider to the snapshot that it leads to, read for the
first time and read again. *heap* is the JavaScript heap of the page after a garbage collection, before and
after the slider went through all snapshots; *web* the resident memory of the server.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median

import torch
from playwright.sync_api import CDPSession, Page, sync_playwright

from benchmarks.charts import CHROMIUM, resident
from parenting.server.board_tables import BoardSnapshot, BoardStates
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.progress import report_progress
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim, set_status
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from tests.access import cookies_in
from tests.database import migrated
from tests.server.serving import free_port, parenting, until_up

FOREVER = 10**9


def live(db: Database, world: str, ticks: int, answers: int) -> RunSession:
    """Live so many ticks, or until so many answers are heard."""
    torch.set_num_threads(1)  # as a worker does
    run = start(db, NewRun(world=world, parent="scripted", seed=1))
    (mine,) = claim(db, "benchmark")
    life = RunSession(db, mine, run, lambda: None)
    while life.last_tick < ticks and int(life.saved.tally.kinds.sum()) < answers:
        life.tick(watch(db, [run.id])[run.id])
    life.save()
    report_progress(db, mine, tick=life.last_tick)
    set_status(db, run.id, RunStatus.STOPPED)
    return life


def stored(db: Database, run: int) -> str:
    """Say in words how much is stored of the board."""
    with db.read() as session:
        rows = session.query(BoardSnapshot.size).filter_by(run_id=run).all()
        states = session.get(BoardStates, run)
        assert states is not None
        size = sum(row.size for row in rows) + len(states.blob)
        return f"{len(rows)} snapshots of {states.states} states, {size / 1e6:.2f} MB"


def steps(page: Page, keys: Sequence[str]) -> list[float]:
    """Press keys on the slider: the milliseconds until each snapshot is painted."""
    script = """key => new Promise(done => {
        const slider = document.getElementById("seen-slider"), began = performance.now();
        const painted = () => requestAnimationFrame(() => done(performance.now() - began));
        new MutationObserver((_, watch) => { watch.disconnect(); painted(); })
            .observe(document.getElementById("seen-arrows"), { childList: true });
        slider.value = Number(slider.value) + (key === "ArrowLeft" ? -1 : 1);
        slider.dispatchEvent(new Event("input"));
    })"""
    return [page.evaluate(script, key) for key in keys]


def heap(page: Page, devtools: CDPSession) -> float:
    """The page's heap after a garbage collection, in MB."""
    devtools.send("HeapProfiler.collectGarbage")
    return float(page.evaluate("performance.memory.usedJSHeapSize")) / 1e6


def look(url: str, folder: Path, run: str) -> None:
    """Open the dashboard, go through all snapshots and back, and print what it took."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page()
        page.context.add_cookies(cookies_in(folder, url))
        devtools = page.context.new_cdp_session(page)
        page.goto(f"{url}/runs/{run}")
        began = time.monotonic()
        page.goto(f"{url}/runs/{run}", wait_until="commit")
        page.wait_for_selector("#seen-arrows path", state="attached")
        shown = time.monotonic() - began
        last = int(page.get_attribute("#seen-slider", "max") or 0)
        before = heap(page, devtools)
        back, again = steps(page, ["ArrowLeft"] * last), steps(page, ["ArrowRight", "ArrowLeft"] * 10)
        page.get_by_label("Visits").check()
        there = steps(page, ["ArrowRight"] * last)
        print(f"shown      {shown:.2f} s")
        print(f"a step     {median(back):.0f} ms, at most {max(back):.0f} ms; again {median(again):.0f} ms")
        print(f"all        {last} steps in {sum(back) / 1e3:.1f} s, with visits {sum(there) / 1e3:.1f} s")
        print(f"heap       {before:.1f} MB before, {heap(page, devtools):.1f} MB after")
        browser.close()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--world", default="unsafe-exploration")
    parser.add_argument("--ticks", type=int, default=20_000)
    parser.add_argument("--answers", type=int, default=FOREVER)
    asked = parser.parse_args()
    ticks = asked.ticks if asked.answers == FOREVER else FOREVER
    with tempfile.TemporaryDirectory() as folder:
        database, began = migrated(Settings(data=Path(folder), database_url=None)), time.monotonic()
        life = live(database, asked.world, ticks, asked.answers)
        heard = int(life.saved.tally.kinds.sum())
        print(f"lived      {life.last_tick} ticks, {heard} answers, in {time.monotonic() - began:.0f} s")
        print(f"stored     {stored(database, life.claim.run_id)}")
        public = life.run.public_id
        database.close()
        port = free_port()
        with parenting("web", "--port", str(port), data=Path(folder)) as web:
            until_up(url := f"http://127.0.0.1:{port}")
            look(url, Path(folder), public)
            print(f"web        {resident(web.pid):.0f} MB")


if __name__ == "__main__":
    main()
