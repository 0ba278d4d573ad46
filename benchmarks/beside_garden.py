"""The time from an answer to the run's next question, beside a garden of 40 x 40 cells and without it.

    python -m benchmarks.beside_garden           200 answers of each kind, about six minutes
    python -m benchmarks.beside_garden --quick   20 of each, about a minute

`parenting up` serves a database in a temporary folder. One run asks for guidance on the island; a scripted
parent raises a garden, whose checkpoints have 58 MB, whose gradient step takes a tenth of a second, and whose
policy is evaluated for seconds. The garden is paused and resumed after every ten answers, so that both kinds
meet the same machine, and the ratio says what the garden costs. *In checkpoints* are the answers beside which
parts of a checkpoint were stored. Our bound is 250 ms on an idle machine (docs/benchmarks.md).
"""

from __future__ import annotations

import argparse
import random
import tempfile
import time
from contextlib import closing
from pathlib import Path
from statistics import median
from typing import Any

import httpx2

from benchmarks.answers import answer, begin
from parenting.server.store.sqlite import sqlite_module
from tests.simulated_person import up

CELLS = 40
ANSWERS, QUICK_ANSWERS, ROUND = 200, 20, 10
SETTLES = 1.0
"""Seconds after the garden is paused or resumed."""
SEED = 3
LAST_PART = "SELECT max(id) FROM checkpoint_part"
HEAD = f"{'':16}{'n':>6}{'p50':>9}{'p99':>9}{'max':>9}  ms"


def garden(cells: int) -> str:
    """A garden with plants along two walls, which the parent's own policy walks round."""
    inside = cells - 2
    rows = [list("#" * cells), *(list(f"#{' ' * inside}#") for _ in range(inside)), list("#" * cells)]
    rows[1][1:-1] = "tT" * (inside // 2)
    rows[-2][1:-1] = "Tt" * (inside // 2)
    rows[cells // 2][cells // 2], rows[cells // 4][cells // 4] = "O", "A"
    walk = " ".join(way * (inside - 1) for way in "rdlu")
    return f"cycle: 2,2 {walk}\n\n" + "\n".join(map("".join, rows)) + "\n"


def begin_garden(web: httpx2.Client, store: Any) -> int:
    """A garden that has been begun and has lived some ticks: its number."""
    settings = {"pretrain": False, "stages": 2}
    body = {"world": "reward-hacking", "level_text": garden(CELLS), "parent": "scripted", "config": settings}
    reply = web.post("/api/v1/runs", json=body)
    reply.raise_for_status()
    number = int(reply.json()["id"])
    while store.execute("SELECT 1 FROM run WHERE id = ? AND tick > 3", (number,)).fetchone() is None:
        time.sleep(0.1)
    return number


def measure(answers: int) -> None:
    """Print the milliseconds from an answer to the next question, by what went on beside."""
    found: dict[str, list[float]] = {"alone": [], "beside a garden": [], "in checkpoints": []}
    with tempfile.TemporaryDirectory() as name, up(Path(name)) as url, httpx2.Client(base_url=url) as web:
        file = Path(name) / "parenting.db"
        with closing(sqlite_module().connect(file, isolation_level=None, timeout=10)) as store:
            run, draws = begin(web, "unsafe-exploration", "conservative", p_pref=0.0), random.Random(SEED)
            great = begin_garden(web, store)
            for verb in ("resume", "pause") * (answers // ROUND):
                web.post(f"/api/v1/runs/{great}/{verb}").raise_for_status()
                time.sleep(SETTLES)
                for _ in range(ROUND):
                    before = store.execute(LAST_PART).fetchone()
                    took = answer(web, store, run, draws)[1]
                    found["alone" if verb == "pause" else "beside a garden"].append(took)
                    if store.execute(LAST_PART).fetchone() != before:
                        found["in checkpoints"].append(took)
        show(found)


def row(kind: str, times: list[float]) -> str:
    """A row of the table."""
    if not times:
        return f"{kind:16}{0:>6}"
    ranked = sorted(times)
    p99 = ranked[-(-99 * len(ranked) // 100) - 1]
    return f"{kind:16}{len(ranked):>6}{median(ranked):9.1f}{p99:9.1f}{ranked[-1]:9.1f}"


def show(found: dict[str, list[float]]) -> None:
    """Print a row for each kind, and the ratio."""
    print(HEAD)
    for kind, times in found.items():
        print(row(kind, times))
    print(f"ratio of the medians {median(found['beside a garden']) / median(found['alone']):.2f}", flush=True)


def main() -> None:
    """Measure as often as the command line says."""
    parser = argparse.ArgumentParser(description="From an answer to the next question, beside a garden.")
    parser.add_argument("--quick", action="store_true", help="few answers")
    measure(QUICK_ANSWERS if parser.parse_args().quick else ANSWERS)


if __name__ == "__main__":
    main()
