"""The cost of a thousand runs that wait for their parents, and what one person among them feels.

    python -m benchmarks.waiting_runs                         1,000 runs, about three minutes
    python -m benchmarks.waiting_runs --runs 300 --answers 50

One worker raises so many runs on the island, each with a question that nobody answers. *Settling* is the
processor time of the worker in the first 35 s after all have asked, in which the last of them write their
checkpoints, and *at rest* that of the time after it, also as a share of a core. *Memory* is the resident size
of the worker then, and at the most. *Next question* is the time from an answer's commit to the commit of the
same run's next question, for one person who answers one run; *first question* is the same for runs that
nobody has answered for long, so that they come back from their checkpoints. Our bounds are 2 %, 600 MB,
150 ms at p99, and 200 ms for coming back.

The yardstick is the time of a durable commit of one connection, taken between the answers.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import quantiles

from sqlalchemy import func, select, text

from benchmarks.waiting import spent
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.notify import Notifier
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease
from parenting.server.settings import Settings
from parenting.server.statuses import QueryStatus
from parenting.server.tables import Query
from tests.database import migrated
from tests.server.processes import Command

CLIENT = "benchmark"
WORLD = "unsafe-exploration"
PATIENCE = 3600.0
SETTLES = 35.0
LOOK_SECONDS = 0.001
HEAD = f"{'':28}{'n':>6}{'p50':>9}{'p95':>9}{'p99':>9}{'max':>9}  ms"


@contextmanager
def raised(runs: int) -> Iterator[tuple[Database, Settings, Command]]:
    """A worker with so many runs, each of which has asked for guidance."""
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(data=Path(folder), database_url=None)
        db = migrated(settings)
        for seed in range(runs):
            start(db, NewRun(world=WORLD, parent="human", seed=seed, config={"p_pref": 0.0}))
        worker = Command("worker", data=settings.data, environment={"PARENTING_CLAIM_SECONDS": "5"})
        try:
            yield db, settings, worker
        finally:
            worker.kill()
            db.close()


def open_questions(db: Database, run: int | None = None) -> int:
    """Return the number of questions that wait, of one run or of all."""
    rows = select(func.count()).where(Query.status == QueryStatus.OPEN)
    with db.read() as session:
        return session.scalar(rows if run is None else rows.where(Query.run_id == run)) or 0


def until_all_wait(db: Database, runs: int) -> float:
    """Return the seconds until every run has asked."""
    began = time.monotonic()
    while open_questions(db) < runs:
        assert time.monotonic() - began < PATIENCE, "the runs do not come to ask"
        time.sleep(0.5)
    return time.monotonic() - began


def memory(pid: int, kind: str = "VmRSS") -> float:
    """Return the resident megabytes of a process, or with `VmHWM` the most that they were."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(kind)) / 1024


def busy(pid: int, seconds: float) -> tuple[float, float]:
    """Return the processor seconds that a process takes in a time from now on, and their share of a core."""
    before, begun = spent([pid]), time.monotonic()
    time.sleep(seconds)
    took = spent([pid]) - before
    return took, took / (time.monotonic() - begun)


def next_question(db: Database, wake: Notifier, run: int) -> float:
    """Answer a run's question; return the milliseconds until its next one is stored."""
    leased = lease(db, run, CLIENT, seconds=60)
    assert leased is not None
    answer(db, leased.id, "either", CLIENT, "human")
    began = time.monotonic()
    wake.notify()
    while not open_questions(db, run):
        assert time.monotonic() - began < PATIENCE, "the run asks no more"
        time.sleep(LOOK_SECONDS)
    return 1000 * (time.monotonic() - began)


def commit(db: Database) -> float:
    """Return the milliseconds of a durable commit of one connection."""
    began = time.monotonic()
    with db.write() as session:
        session.execute(text("UPDATE run SET description = :now WHERE id = 1"), {"now": str(began)})
    return 1000 * (time.monotonic() - began)


def show(name: str, found: list[float]) -> None:
    """Print a line of the table."""
    cuts = quantiles(found, n=100, method="inclusive")
    line = "".join(f"{one:9.1f}" for one in (cuts[49], cuts[94], cuts[98], max(found)))
    print(f"{name:28}{len(found):6}{line}", flush=True)


def measure(runs: int, answers: int, seconds: float, thinking: float) -> None:
    """Print what so many waiting runs cost."""
    with raised(runs) as (db, settings, worker):
        pid = worker.process.pid
        took = until_all_wait(db, runs)
        settling, rest = busy(pid, SETTLES), busy(pid, seconds)
        print(f"{runs} runs: all have asked after {took:.0f} s", flush=True)
        for name, (cpu, share) in (("settling", settling), ("at rest", rest)):
            print(f"{name:9}{cpu:6.2f} s of the processor, {100 * share:.1f} % of a core", flush=True)
        print(f"memory {memory(pid):.0f} MB, at most {memory(pid, 'VmHWM'):.0f} MB", flush=True)
        wake, one, commits = Notifier(settings.data, "worker"), runs // 2, []
        times: dict[str, list[float]] = {"next question": [], "first question": []}
        for _ in range(answers):
            commits.append(commit(db))
            time.sleep(thinking)
            times["next question"].append(next_question(db, wake, one))
        for run in range(1, min(runs // 2, answers)):
            time.sleep(thinking)
            times["first question"].append(next_question(db, wake, run))
        print(HEAD)
        show("a durable commit", commits)
        for name, found in times.items():
            show(name, found)
        print(f"memory at the end {memory(pid):.0f} MB")


def main() -> None:
    """Read the options and measure."""
    parser = argparse.ArgumentParser(description="The cost of runs that wait.")
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--answers", type=int, default=100, help="of one run, and of as many others")
    parser.add_argument("--seconds", type=float, default=30, help="for which the worker is watched at rest")
    parser.add_argument("--thinking", type=float, default=0.3, help="seconds before each answer")
    chosen = parser.parse_args()
    print(f"{os.cpu_count()} cores, load average {os.getloadavg()[0]:.2f} at the start")
    measure(chosen.runs, chosen.answers, chosen.seconds, chosen.thinking)


if __name__ == "__main__":
    main()
