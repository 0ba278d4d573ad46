"""Processor seconds of a tick early and late in the life of a garden, beside the estimate (docs/worlds.md).

    python -m benchmarks.late_ticks 12 24 40        garden sizes; 60 ticks of each

One thread of torch raises all gardens in turn, a tick of each at a time, so that they meet the same machine.
A scripted parent answers at once. Processor time is counted, since others may use the machine.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from contextlib import closing
from pathlib import Path
from statistics import mean

import torch

from benchmarks.beside_garden import garden
from parenting.agent.config import Config
from parenting.envs import registry
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue import worker_side
from parenting.server.runs import claim, get_run
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.weights.cost import estimate
from tests.database import migrated

EARLY, TICKS = 6, 60
WORLD = "reward-hacking"


def begin(db: Database, cells: int) -> RunSession:
    """A garden of so many cells on a side, raised by this process."""
    config = {"pretrain": False, "stages": 2}
    new = {"world": WORLD, "level_text": garden(cells), "parent": "scripted", "finish": "never"}
    run = start(db, NewRun.model_validate({**new, "config": config}))
    mine = next(one for one in claim(db, "benchmark") if one.run_id == run.id)
    return RunSession(db, mine, get_run(db, run.id), lambda: None)


def tick(life: RunSession) -> float:
    """Live one tick; the processor seconds that it took."""
    began = time.process_time()
    life.tick(worker_side.watch(life.db, [life.claim.run_id])[life.claim.run_id])
    return time.process_time() - began


def main() -> None:
    """Raise the gardens and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("cells", type=int, nargs="+")
    parser.add_argument("--ticks", type=int, default=TICKS)
    chosen = parser.parse_args()
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as folder, closing(migrated(Settings(data=Path(folder)))) as db:
        lives = {cells: begin(db, cells) for cells in chosen.cells}
        took: dict[int, list[float]] = {cells: [] for cells in lives}
        for _ in range(chosen.ticks):
            for cells, life in lives.items():
                took[cells].append(tick(life))
        for cells, life in lives.items():
            run = get_run(db, life.claim.run_id)
            level = registry.level(run.world, run.level_text)
            said = estimate(registry.spec(run.world, level), level, Config.model_validate(run.config))
            early, late = mean(took[cells][2:EARLY]), mean(took[cells][-EARLY:])
            answers = int(life.saved.tally.kinds.sum())
            print(f"{cells:3} x {cells}: early {early:.3f} s, late {late:.3f} s ({answers} answers); {said}")


if __name__ == "__main__":
    main()
