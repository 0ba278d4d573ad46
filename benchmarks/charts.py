"""The dashboard of a run with many rows of metrics: bytes, seconds and memory, whole and thinned.

    python -m benchmarks.charts                50,000 rows
    python -m benchmarks.charts --rows 1000    a short life, to compare with

A run with these rows is made in a temporary folder and served by `parenting web`. First the API is asked for
what the charts show: as all rows, page by page, and as curves of 2,000 points at most. Then Chromium opens
the dashboard, and the time counts from the click to the last chart that is drawn. *heap* is the JavaScript
heap of the page after a garbage collection, *web* the resident memory of the server, before and after.
"""

from __future__ import annotations

import argparse
import os
import random
import tempfile
import time
from pathlib import Path

import httpx2
from playwright.sync_api import sync_playwright
from sqlalchemy import insert

from parenting.server.metrics import write_metrics
from parenting.server.new_run import NewRun, start
from parenting.server.progress import report_progress
from parenting.server.runs import claim, set_status
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from parenting.server.tables import Metric
from tests.access import cookies_in
from tests.database import migrated
from tests.server.serving import free_port, parenting, until_up

CHROMIUM = os.environ.get("PARENTING_CHROMIUM", "/usr/bin/chromium")
NAMES = (
    "deaths,guidance,preference,skips,left,right,either,neither,return,optimal_return,loss,entropy_global,"
    "entropy_local,rows,size"
)
DRAWN = """() => { const all = [...document.querySelectorAll("[data-chart] .plot")];
  return all.length && all.every(plot => plot.querySelector(".scatterlayer path, .barlayer path")); }"""


def row(tick: int, chance: random.Random) -> dict[str, float]:
    """Metrics as a long life on the island has them."""
    counts = {"deaths": 1000, "episodes": 20, "guidance": 90, "preference": 70, "left": 200, "right": 210}
    counts |= {"either": 300, "neither": 400, "size": 60, "rows": 62, "stage_queries": 33}
    learnt = {name: chance.random() for name in ("loss", "entropy_global", "entropy_local")}
    worth = {"return": chance.uniform(-5, 45), "optimal_return": 45.0, "optimal": 0, "speed": 100.0}
    return {
        **{name: tick // every for name, every in counts.items()},
        **learnt,
        **worth,
        "skips": 0,
        "maturity": 1,
    }


def fill(folder: Path, rows: int) -> None:
    """Make a run with so many rows, four ticks apart."""
    database, chance = migrated(Settings(data=folder, database_url=None)), random.Random(0)
    run = start(database, NewRun(world="unsafe-exploration", parent="scripted"))
    (mine,) = claim(database, "benchmark")
    made = [{"run_id": run.id, "tick": 4 * place, "values": row(4 * place, chance)} for place in range(rows)]
    with database.write() as session:
        session.execute(insert(Metric), made)
    write_metrics(database, mine, {4 * rows: row(4 * rows, chance)})
    report_progress(database, mine, tick=4 * rows)
    set_status(database, run.id, RunStatus.STOPPED)
    database.close()


def all_rows(web: httpx2.Client) -> int:
    """Read every row, page by page: the bytes of the bodies."""
    size, after = 0, -1
    while after is not None:
        reply = web.get(f"/api/v1/runs/1/metrics?after={after}").raise_for_status()
        size, after = size + len(reply.content), reply.json()["next"]
    return size


def thinned(web: httpx2.Client) -> int:
    """Read the curves of the charts: the bytes of the body."""
    return len(web.get(f"/api/v1/runs/1/curves?names={NAMES}").raise_for_status().content)


def resident(pid: int) -> float:
    """The resident memory of a process, in MB."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.partition("VmRSS:")[2].split()[0]) / 1e3


def opened(url: str, folder: Path) -> tuple[float, float, float]:
    """Open the dashboard once more: seconds until it is drawn, MB that it received, MB of heap."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page()
        page.context.add_cookies(cookies_in(folder, url))
        page.goto(f"{url}/runs/1")
        page.wait_for_function(DRAWN, timeout=120_000)
        devtools = page.context.new_cdp_session(page)
        devtools.send("Network.enable")
        received = [0.0]
        devtools.on("Network.dataReceived", lambda event: received.append(event["dataLength"] / 1e6))
        began = time.monotonic()
        page.goto(f"{url}/runs/1")
        page.wait_for_function(DRAWN, timeout=120_000)
        seconds = time.monotonic() - began
        page.wait_for_timeout(1000)
        devtools.send("HeapProfiler.collectGarbage")
        heap = page.evaluate("performance.memory.usedJSHeapSize") / 1e6
        browser.close()
        return seconds, sum(received), heap


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rows", type=int, default=50_000)
    rows = parser.parse_args().rows
    with tempfile.TemporaryDirectory() as name:
        folder, port = Path(name), free_port()
        fill(folder, rows)
        url = f"http://127.0.0.1:{port}"
        with parenting("web", "--port", str(port), data=folder) as child, httpx2.Client(base_url=url) as web:
            until_up(url)
            print(f"{rows} rows; web {resident(child.pid):.0f} MB")
            for what, read in (("curves", thinned), ("all rows", all_rows)):
                began = time.monotonic()
                size = read(web)
                took = time.monotonic() - began
                print(f"{what:10}{size / 1e6:8.2f} MB{took:8.2f} s; web {resident(child.pid):.0f} MB")
            seconds, received, heap = opened(url, folder)
            print(f"{'dashboard':10}{received:8.2f} MB{seconds:8.2f} s; web {resident(child.pid):.0f} MB")
            print(f"JavaScript heap of the dashboard {heap:.0f} MB")


if __name__ == "__main__":
    main()
