"""The cost of a worker that waits, and the time until an answer wakes it, with and without hints.

    python -m benchmarks.waiting                       both stores, a minute for each number of runs
    python -m benchmarks.waiting --seconds 20 --answers 50 --stores sqlite

*Cost* is the processor time of the worker process, as a share of one core, and apart from it that of
PostgreSQL's processes for it, while its runs wait for answers. *Wake-up* is the time from the commit of an
answer to the commit of the tick that hears it. A hint is a datagram after the commit, and on PostgreSQL a
notification too; without hints (`server.notify` and `server.store.relay` send and hear nothing) the poll
alone finds the answer. Our bounds are one per cent and 100 ms at p99 even without hints.

PostgreSQL runs as it is installed, with `fsync` on. The load of the machine is printed: processor time is
little moved by other work, wake-ups are.
"""

from __future__ import annotations

import argparse
import os
import random
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from statistics import quantiles
from typing import Any
from unittest.mock import patch

from parenting.server import notify
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.notify import Notifier
from parenting.server.queue import worker_side
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease
from parenting.server.settings import Settings
from parenting.server.store.relay import Relay
from tests.database import STORES, database_url, migrated
from tests.postgres import cluster
from tests.server.processes import Command, store_of

RUNS = (0, 10)
SETTLES = 3.0
"""Seconds until a worker that has just begun is at rest."""
CLIENT = "benchmark"
TICK = os.sysconf("SC_CLK_TCK")


def lose_hints() -> None:
    """Neither send nor hear any hint in this process."""
    patch.object(notify, "_send").start()
    patch.object(Relay, "start").start()


def note_ticks(file: str, hints: bool) -> None:
    """Have this process note the moment after each tick's look for an answer that found one."""
    if not hints:
        lose_hints()
    take, out = worker_side.take_answer, os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND)

    def noted(*arguments: Any) -> Any:
        taken = take(*arguments)
        if taken is not None:
            os.write(out, f"{taken.query.id} {time.monotonic()}\n".encode())
        return taken

    patch.object(worker_side, "take_answer", noted).start()


@contextmanager
def raised(store: str, runs: int, hints: bool = True) -> Iterator[tuple[Database, Settings, Command, Path]]:
    """A worker with so many runs that wait for answers."""
    with tempfile.TemporaryDirectory() as folder, database_url(store) as url:
        settings = Settings(data=Path(folder), database_url=url)
        db = migrated(settings)
        for seed in range(runs):
            start(db, NewRun(world="unsafe-exploration", parent="human", seed=seed, config={}))
        notes = Path(folder) / "ticks"
        worker = Command(
            "worker",
            data=settings.data,
            environment=store_of(settings) | {"PARENTING_CLAIM_SECONDS": "10"},
            prepare=partial(note_ticks, str(notes), hints),
        )
        try:
            time.sleep(SETTLES + 0.3 * runs)
            yield db, settings, worker, notes
        finally:
            worker.kill()
            db.close()


def spent(pids: list[int]) -> float:
    """Return the processor seconds of these processes so far."""
    fields = [Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split() for pid in pids]
    return sum(int(one[11]) + int(one[12]) for one in fields) / TICK


def backends(store: str) -> list[int]:
    """Return PostgreSQL's processes for the clients of all databases, but for the asking one."""
    if store != "postgresql":
        return []
    rows = cluster().admin.execute(
        "SELECT pid FROM pg_stat_activity WHERE backend_type = 'client backend' AND pid <> pg_backend_pid()"
    )
    return [row[0] for row in rows.fetchall()]


def cost(store: str, runs: int, seconds: float) -> tuple[float, float]:
    """Return the shares of a core that a waiting worker and its store's processes take."""
    with raised(store, runs) as (db, _, worker, _notes):
        db.engine.dispose()  # only the worker's are left
        pids, before = backends(store), 0.0
        before, behind = spent([worker.process.pid]), spent(pids)
        time.sleep(seconds)
        gone = set(pids) - set(backends(store))
        assert not gone, "connections come and go while nothing happens"
        return (spent([worker.process.pid]) - before) / seconds, (spent(pids) - behind) / seconds


def wake_ups(store: str, answers: int, hints: bool) -> list[float]:
    """Return the milliseconds from an answer's commit to the tick that hears it."""
    with raised(store, 3, hints) as (db, settings, _, notes):
        told: dict[int, float] = {}
        while len(told) < answers:
            time.sleep(random.uniform(0.2, 0.3))  # anywhere between two polls
            for run in (1, 2, 3):
                leased = lease(db, run, CLIENT, seconds=60)
                if leased is not None:
                    break
            else:
                continue
            answer(db, leased.id, "left" if leased.kind == "preference" else "either", CLIENT, "human")
            told[leased.id] = time.monotonic()
            if hints:
                Notifier(settings.data, "worker").notify()
        time.sleep(1)
        rows = [line.split() for line in notes.read_text().splitlines()]
        heard = {int(number): float(moment) for number, moment in rows}
        return [1000 * (heard[number] - since) for number, since in told.items()]


def main() -> None:
    """Read the options and print both tables."""
    parser = argparse.ArgumentParser(description="The cost of waiting, and the time to wake up.")
    parser.add_argument("--seconds", type=float, default=60, help="for each number of waiting runs")
    parser.add_argument("--answers", type=int, default=200, help="for each way to wake up")
    parser.add_argument("--stores", nargs="*", choices=STORES, default=STORES)
    chosen = parser.parse_args()
    cores, load = os.cpu_count(), os.getloadavg()[0]
    print(f"{cores} cores, load average {load:.2f} at the start")
    print("waiting, in % of a core\n  store       runs  worker  store's processes")
    for store in chosen.stores:
        for runs in RUNS if chosen.seconds else ():
            mine, behind = cost(store, runs, chosen.seconds)
            print(f"  {store:10}{runs:6}{100 * mine:8.2f}{100 * behind:19.2f}", flush=True)
    print("from an answer's commit to its tick, in ms\n  store       hints   answers     p50     p99     max")
    for store in chosen.stores:
        for hints in (True, False) if chosen.answers else ():
            times = wake_ups(store, chosen.answers, hints)
            cuts = quantiles(times, n=100, method="inclusive")
            line = f"{len(times):8}{cuts[49]:8.1f}{cuts[98]:8.1f}{max(times):8.1f}"
            print(f"  {store:10}  {'come' if hints else 'lost':6}{line}", flush=True)


if __name__ == "__main__":
    main()
