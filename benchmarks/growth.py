"""The growth of a database by answers, table by table.

    python -m benchmarks.growth                   1,000 answers in each of two worlds, about a minute
    python -m benchmarks.growth --answers 100     fewer

A scripted parent raises one conservative agent as a worker does, on SQLite. The bytes are those of SQLite's
pages (`dbstat`), indexes by themselves, and what the database held before the first tick is taken off.
Checkpoints are left out of the sum: a run has at most two, however long it lives.
"""

from __future__ import annotations

import argparse
import sqlite3
import tempfile
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path

import torch

from parenting.server.new_run import NewRun, start
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from tests.database import migrated

WORLDS = ("unsafe-exploration", "side-effects")
ANSWERS = 1000
KEPT = ("checkpoint", "checkpoint_part")
"""Tables that do not grow with the answers of a run."""
LEAST = 0.005
"""Megabytes a thousand answers that have a line of their own."""


def sizes(file: Path) -> dict[str, int]:
    """Bytes of each table and index. The SQLite that comes with Python counts them; ours is built without."""
    with closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True)) as store:
        return dict(store.execute("SELECT name, sum(pgsize) FROM dbstat GROUP BY name"))


def grown(world: str, answers: int) -> Mapping[str, int]:
    """Raise an agent until so many answers are heard; the bytes that this added."""
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(data=Path(folder))
        db = migrated(settings)
        run = start(db, NewRun(world=world, parent="scripted", preset="conservative", seed=1))
        before = sizes(Path(folder) / "parenting.db")
        (mine,) = claim(db, "benchmark")
        life = RunSession(db, mine, run, lambda: None)
        while int(life.saved.tally.kinds.sum()) < answers:
            life.tick(watch(db, [run.id])[run.id])
        life.end()
        db.close()
        after = sizes(Path(folder) / "parenting.db")
    return {name: size - before.get(name, 0) for name, size in after.items()}


def main() -> None:
    """Print a table for each world."""
    parser = argparse.ArgumentParser(description="Megabytes that a thousand answers add to a database.")
    parser.add_argument("--answers", type=int, default=ANSWERS)
    answers = parser.parse_args().answers
    torch.set_num_threads(1)  # as a worker does
    for world in WORLDS:
        found = grown(world, answers)
        each = {name: size / 1e3 / answers for name, size in found.items()}
        print(f"{world}, {answers} answers: megabytes a thousand answers")
        for name, size in sorted(each.items(), key=lambda one: -one[1]):
            if size >= LEAST:
                print(f"  {name:<40} {size:6.3f}{'  (kept: two)' if name in KEPT else ''}")
        print(
            f"  {'in all, without checkpoints':<40} {sum(s for n, s in each.items() if n not in KEPT):6.3f}\n"
        )


if __name__ == "__main__":
    main()
