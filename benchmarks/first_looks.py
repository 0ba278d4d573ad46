"""The first page of a server that has just started, and a state that a worker computes for the board.

    python -m benchmarks.first_looks

Lives of a few ticks are stored: one on the island, and one in a garden of 40 x 40 cells, whose checkpoints
have 58 MB. `parenting up` is started several times on them. *First page* is the request of a dashboard at
once after the server has first answered, while the worker still loads torch; *again* the same request once
more; *empty* one of `/healthz`. *State* counts from the request of a job `state` until its result is read,
asked for again every 20 ms. Each is a median in ms, with its ratio to an empty request of the same start.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import httpx2
import torch

from benchmarks.beside_garden import CELLS, garden
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.progress import report_progress
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim, set_status
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from tests.database import migrated
from tests.simulated_person import up

STARTS, STATES = 5, 10
CELL = {"reward-hacking": (CELLS // 4, CELLS // 4), "unsafe-exploration": (2, 2)}
"""A cell where an agent can stand, for each world."""


def live(db: Database, world: str, level_text: str | None) -> int:
    """Live some ticks, and store two checkpoints."""
    torch.set_num_threads(1)  # as a worker does
    new = NewRun(world=world, level_text=level_text, parent="scripted", seed=1, config={"pretrain": False})
    run = start(db, new)
    (mine,) = claim(db, "benchmark")
    life = RunSession(db, mine, run, lambda: None)
    for _ in range(2):
        life.tick(watch(db, [run.id])[run.id])
        life.save()
    report_progress(db, mine, tick=life.last_tick)
    set_status(db, run.id, RunStatus.PAUSED)  # so that both checkpoints are kept
    return run.id


def took(act: Callable[[], object]) -> float:
    """Milliseconds that something takes."""
    began = time.perf_counter()
    act()
    return 1e3 * (time.perf_counter() - began)


def state(web: httpx2.Client, run: int, world: str) -> None:
    """Ask for a state, and wait for the result."""
    row, column = CELL[world]
    body = {"client_id": "benchmark", "kind": "state", "payload": {"row": row, "column": column}}
    job: dict[str, Any] = web.post(f"/api/v1/runs/{run}/jobs", json=body).raise_for_status().json()
    while job["state"] in ("waiting", "working"):
        time.sleep(0.02)
        job = web.get(f"/api/v1/jobs/{job['id']}").raise_for_status().json()
    assert job["state"] == "done", job


def looked(folder: Path, runs: dict[str, int]) -> dict[str, list[float]]:
    """Start the server once: the times of everything in it."""
    with up(folder) as url, httpx2.Client(base_url=url, timeout=60, follow_redirects=True) as web:
        page = f"/runs/{next(iter(runs.values()))}"
        found = {"first page": [took(lambda: web.get(page).raise_for_status())]}
        found["again"] = [took(lambda: web.get(page).raise_for_status())]
        for run in runs.values():
            state(web, run, next(world for world in runs if runs[world] == run))  # the worker has come up
        found["empty"] = [took(lambda: web.get("/healthz").raise_for_status()) for _ in range(STATES)]
        for world, run in runs.items():
            times = [took(lambda run=run, world=world: state(web, run, world)) for _ in range(STATES)]  # type: ignore[misc]  # lambdas of a loop
            found[f"state, {world}"] = times
    return found


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    ).parse_args()
    found: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        db = migrated(Settings(data=folder, database_url=None))
        levels = {"unsafe-exploration": None, "reward-hacking": garden(CELLS)}
        runs = {world: live(db, world, text) for world, text in levels.items()}
        db.close()
        for _ in range(STARTS):
            for what, times in looked(folder, runs).items():
                found.setdefault(what, []).extend(times)
    empty = median(found["empty"])
    for what, times in found.items():
        print(f"{what:28}{median(times):9.1f} ms{max(times):9.1f} at most{median(times) / empty:9.0f} times")


if __name__ == "__main__":
    main()
