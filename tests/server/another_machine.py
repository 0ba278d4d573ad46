"""A program that raises the first run of a database for some ticks, as a worker on another CPU would.

ATEN_CPU_CAPABILITY is read when torch loads, so this runs in a process of its own:

    python -m tests.server.another_machine DATA URL CHECKPOINT TICKS
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import torch
from sqlalchemy import text

from parenting.server import checkpoint_pace, runs
from parenting.server.db import Database, connect
from parenting.server.queue import worker_side
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from tests.tree import ROOT

RUN = 1


def taken_up(db: Database) -> RunSession:
    """The run, taken up by a new worker, whoever had it."""
    with db.write() as session:
        session.execute(text("UPDATE run SET worker = NULL"))
    (mine,) = runs.claim(db, "worker")
    return RunSession(db, mine, runs.get_run(db, RUN), lambda: None)


def live_to(life: RunSession, tick: int) -> None:
    while life.last_tick < tick:
        seen = worker_side.watch(life.db, [RUN])[RUN]
        assert life.ready(seen), f"the run waits at tick {life.last_tick}"
        life.tick(seen)


def raised_elsewhere(settings: Settings, capability: str, checkpoint: int, ticks: int) -> str:
    """Raise the run on a CPU of this capability, killed without warning at the end; what torch says it is."""
    environment = {**os.environ, "ATEN_CPU_CAPABILITY": capability, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "tests.server.another_machine", str(settings.data), settings.url]
    done = subprocess.run(
        [*command, str(checkpoint), str(ticks)], env=environment, cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == -9, done.stderr
    return done.stdout.split()[-1]


def main(data: str, url: str, checkpoint: int, ticks: int) -> None:
    torch.set_num_threads(1)
    checkpoint_pace.CHECKPOINT_SECONDS = 1e9
    db = connect(Settings(data=Path(data), database_url=url))
    life = taken_up(db)
    if checkpoint:
        live_to(life, checkpoint)
        life.save()
    live_to(life, ticks)
    print(torch.backends.cpu.get_cpu_capability(), flush=True)
    os.kill(os.getpid(), 9)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
