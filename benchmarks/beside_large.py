"""The time from an answer to the run's next question, beside three large runs and without them.

    python -m benchmarks.beside_large           200 answers of each kind, about ten minutes
    python -m benchmarks.beside_large --quick   20 of each, about two minutes

`parenting up` serves a database in a temporary folder. One run asks for guidance on the island.
Scripted parents raise two islands whose ticks take a thousand gradient steps each, and a garden of 62 x 62
cells, whose policy has twelve million weights. These are paused and resumed after every ten answers, so that
both kinds meet the same machine, and the ratio says what they cost. They do all that belongs to a run:
gradient steps, checkpoints, snapshots of the board, evaluation and metrics. Our bound is 250 ms for the wait
on an idle machine (docs/benchmarks.md).
"""

from __future__ import annotations

import argparse
import os
import random
import tempfile
import time
from contextlib import closing
from pathlib import Path
from statistics import median
from typing import Any

import httpx2

from benchmarks.answers import answer, begin
from benchmarks.beside_garden import HEAD, garden, row
from parenting.server.store.sqlite import sqlite_module
from tests.simulated_person import up

CELLS, STEPS, ISLANDS = 62, 1000, 2
ANSWERS, QUICK_ANSWERS, ROUND = 200, 20, 10
SETTLES = 2.0
"""Seconds after the large runs are paused or resumed."""
PATIENCE = 1800.0
SEED = 3


def begin_large(web: httpx2.Client, store: Any, cells: int) -> list[int]:
    """The large runs, once each has lived some ticks: their numbers."""
    steps: dict[str, Any] = {"gradient_steps": STEPS, "p_train": 1.0}
    island = {"world": "unsafe-exploration", "parent": "scripted", "finish": "never", "config": steps}
    wide = {"world": "reward-hacking", "level_text": garden(cells), "parent": "scripted"}
    bodies = [{**island, "seed": SEED + one} for one in range(ISLANDS)]
    bodies.append({**wide, "config": {"pretrain": False, "stages": 2}})
    replies = [web.post("/api/v1/runs", json=body).raise_for_status() for body in bodies]
    numbers = [int(reply.json()["id"]) for reply in replies]
    end = time.monotonic() + PATIENCE
    while ticks(store, numbers) < len(numbers):
        assert time.monotonic() < end, "the large runs do not begin to live"
        time.sleep(0.5)
    return numbers


def ticks(store: Any, numbers: list[int], least: int = 2) -> int:
    """The number of these runs that have lived for some ticks."""
    marks = ",".join("?" * len(numbers))
    found = store.execute(f"SELECT count(*) FROM run WHERE tick > {least} AND id IN ({marks})", numbers)
    return int(found.fetchone()[0])


def measure(answers: int, cells: int) -> None:
    """Print the milliseconds from an answer to the next question, by what went on beside."""
    found: dict[str, list[float]] = {"alone": [], "beside": []}
    with tempfile.TemporaryDirectory() as name, up(Path(name)) as url, httpx2.Client(base_url=url) as web:
        file = Path(name) / "parenting.db"
        with closing(sqlite_module().connect(file, isolation_level=None, timeout=10)) as store:
            run, draws = begin(web, "unsafe-exploration", "conservative", p_pref=0.0), random.Random(SEED)
            large = begin_large(web, store, cells)
            for verb in ("resume", "pause") * (answers // ROUND):
                for one in large:
                    web.post(f"/api/v1/runs/{one}/{verb}").raise_for_status()
                time.sleep(SETTLES)
                for _ in range(ROUND):
                    found["alone" if verb == "pause" else "beside"].append(answer(web, store, run, draws)[1])
            lived = store.execute("SELECT id, tick FROM run WHERE parent = 'scripted'").fetchall()
        show(found)
        print("ticks of the large runs: " + ", ".join(str(tick) for _, tick in lived))


def show(found: dict[str, list[float]]) -> None:
    """Print a row for each kind, and the ratios."""
    print(HEAD)
    for kind, times in found.items():
        print(row(kind, times))
    alone, beside = (sorted(found[kind]) for kind in ("alone", "beside"))
    print(
        f"ratio of the medians {median(beside) / median(alone):.2f}, of the most {beside[-1] / alone[-1]:.2f}"
    )


def main() -> None:
    """Measure as often as the command line says."""
    parser = argparse.ArgumentParser(description="From an answer to the next question, beside large runs.")
    parser.add_argument("--quick", action="store_true", help="few answers")
    parser.add_argument("--cells", type=int, default=CELLS, help="rows and columns of the garden")
    chosen = parser.parse_args()
    print(f"{os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f}", flush=True)
    measure(QUICK_ANSWERS if chosen.quick else ANSWERS, chosen.cells)


if __name__ == "__main__":
    main()
