"""A crowd answers many runs, one of the workers is killed in the middle, and every run goes on to its end.

The long form has fifty people, three workers, and Chromium before the list of runs and a dashboard; its
pictures at 1280 and 390 pixels lie in PARENTING_PICTURES, if that names a folder.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page

from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.replay import relive
from parenting.server.runs import get_run, list_runs
from parenting.server.settings import Settings
from parenting.server.statuses import OVER, RunStatus
from parenting.server.tables import Run
from parenting.server.workers import is_here
from tests.access import cookies
from tests.faults.auditor import Store, audit
from tests.faults.crowds import crowded, figures_of
from tests.faults.figures import Figures
from tests.faults.ledger import Entries
from tests.lengths import TORTURE, length
from tests.pages.browser_tabs import BrowserTabs
from tests.server.processes import Command
from tests.simulated_person import chromium

pytestmark = [pytest.mark.torture, pytest.mark.timeout(length(1800, 3600))]
PEOPLE, RUNS, WORKERS, ANSWERS = length((3, 2, 2, 4), (50, 50, 3, 12))
THINK = length("0.05", "1.0")
CLAIM_SECONDS = "1.0"
PATIENCE = length(60.0, 900.0)
WIDTHS = (1280, 390)
SPEED = {
    "parenting.server.checkpoint_pace.CHECKPOINT_SECONDS": 0.2,
    "parenting.server.checkpoint_pace.CHECKPOINT_SPEED": 1e12,
}


def until(holds: Any, said: str) -> None:
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end, said
        time.sleep(0.05)


@contextmanager
def watched(url: str, db: Database, run: str) -> Iterator[list[Page]]:
    """The list of runs and a dashboard in two widths, which must show no error and never go blank."""
    if not TORTURE:
        yield []
        return
    path = os.environ.get("PARENTING_CHROMIUM") or shutil.which("chromium") or "chromium"
    with chromium(path) as browser:
        tabs = BrowserTabs(browser, url, cookies(db, url))
        views = [(place, width) for place in ("/", f"/runs/{run}") for width in WIDTHS]
        pages = [tabs.open(place, viewport={"width": width, "height": 900}) for place, width in views]
        yield pages
        assert [page.locator("h1").count() for page in pages] == [1] * len(pages)
        assert tabs.wrong == []
        tabs.close()


def picture(pages: list[Page], name: str) -> None:
    folder = os.environ.get("PARENTING_PICTURES")
    for number, page in enumerate(pages if folder else ()):
        page.screenshot(path=Path(str(folder)) / f"crowd-{name}-{number}.png")


def test_a_worker_of_several_is_killed_under_a_crowd(
    settings: Settings, db: Database, kept: Store, figures: Figures
) -> None:
    for seed in range(RUNS):
        start(
            db,
            NewRun(
                world="unsafe-exploration",
                seed=seed,
                config={"max_open_preferences": 0},
                finish=f"goal:{ANSWERS}",
            ),
        )
    with ExitStack() as stack:
        house = stack.enter_context(
            crowded(settings, WORKERS, {"PARENTING_CLAIM_SECONDS": CLAIM_SECONDS}, SPEED)
        )
        url, workers = house.url, house.workers
        until(lambda: len(raisers(db)) == WORKERS, "each worker raises a run")
        pages = stack.enter_context(watched(url, db, list_runs(db)[0].public_id))
        bots = house.answer("--people", str(PEOPLE), "--think", THINK)
        half = RUNS * ANSWERS // 2
        until(lambda: sum(run.answers for run in list_runs(db)) >= half, "half of the answers")
        picture(pages, "before")
        least, victim = raised_least(db, workers)
        victim.kill()
        figures.count("crowd", "workers killed")
        until(lambda: over(db), f"the end of all runs: {[(run.id, run.status) for run in list_runs(db)]}")
        picture(pages, "after")
        assert bots.wait(60) == 0, bots.said()
        for worker in workers:
            assert worker is victim or worker.stop() == 0, worker.said()
    found = figures_of(bots)
    runs = list_runs(db)
    assert {run.status for run in runs} == {RunStatus.FINISHED}
    assert get_run(db, least.id).fencing_token > least.fencing_token, "another worker took it up"
    assert found["answered"] == sum(run.standing for run in runs), "each answer was stored once"
    assert audit(kept, Entries([], [])) == []
    different = [run.id for run in runs if not relive(db, run.id).equal]
    assert different == []
    figures.count("crowd", "runs replayed equal", len(runs))


def raised_least(db: Database, workers: Sequence[Command]) -> tuple[Run, Command]:
    """The run with the fewest answers, and the worker that raises it."""
    found: list[tuple[Run, Command]] = []

    def look() -> bool:
        run = min(list_runs(db), key=lambda one: one.answers)
        found[:] = [(run, one) for one in workers if is_here(run.worker or "", one.process.pid)]
        return bool(found)

    until(look, "a worker raises it")
    return found[0]


def over(db: Database) -> bool:
    return all(run.status in OVER for run in list_runs(db))


def raisers(db: Database) -> set[str]:
    return {run.worker for run in list_runs(db) if run.worker is not None and run.status not in OVER}
