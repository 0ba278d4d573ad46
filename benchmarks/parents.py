"""Answers a second of many parents at once, as a ratio to a yardstick taken at the same moment.

    python -m benchmarks.parents    64 parents without a pause, then 50 that think for a second

A web process serves a run that has questions enough. Each parent leases one, answers it and goes on, over a
connection of its own; all parents live in four other processes. The yardstick is the durable commits a second
of one connection to a database beside it, before and after. On a machine with other work only the ratio says
something. Our minimum is 0.25 (docs/reliability.md).
"""

from __future__ import annotations

import argparse
import http.client
import json
import multiprocessing
import tempfile
import threading
import time
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from parenting.server.new_run import NewRun, start
from parenting.server.settings import Settings
from parenting.server.store.sqlite import PRAGMAS, sqlite_module
from parenting.server.tables import Query
from tests.database import migrated
from tests.server.conftest import CLIPS
from tests.server.processes import command
from tests.server.serving import free_port, until_up

CLOSED, THINKING, PROCESSES = 64, 50, 4
QUESTIONS_A_SECOND = 600
"""More than are answered, so that no parent ever waits for one."""


class Measured(NamedTuple):
    """Answers of one crowd of parents."""

    parents: int
    thinks: float
    answers: float  # a second
    yardstick: float  # commits a second
    p50: float  # milliseconds from a lease to the reply to its answer
    p99: float
    errors: int

    def __str__(self) -> str:
        """A row of the table."""
        ratio = f"{self.answers / self.yardstick:8.3f}"
        times = f"{self.p50:8.0f}{self.p99:8.0f}{self.errors:8}"
        return f"{self.parents:8}{self.thinks:8.0f}{self.answers:10.0f}{self.yardstick:11.0f}{ratio}{times}"


def commits(folder: Path, seconds: float) -> float:
    """Durable commits a second of one connection."""
    store = sqlite_module().connect(folder / "yardstick.db", isolation_level=None)
    for name, value in PRAGMAS.items():
        store.execute(f"PRAGMA {name}={value}").fetchall()
    store.execute("CREATE TABLE IF NOT EXISTS line (word)")
    began, done = time.perf_counter(), 0
    while time.perf_counter() - began < seconds:
        store.execute("INSERT INTO line VALUES ('a')")
        done += 1
    store.close()
    return done / (time.perf_counter() - began)


def crowd(port: int, run: int, names: list[str], thinks: float, end: float, out: Any) -> None:
    """Parents in one process: put their times and the number of their errors into `out`."""
    times, errors = list[float](), list[int]()
    threads = [
        threading.Thread(target=parent, args=(port, run, name, thinks, end, times, errors)) for name in names
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    out.put((times, len(errors)))


def parent(
    port: int, run: int, name: str, thinks: float, end: float, times: list[float], errors: list[int]
) -> None:
    """Lease, answer, think, until the end."""
    web = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    while time.monotonic() < end:
        began = time.perf_counter()
        status, question = _post(web, f"/api/v1/runs/{run}/queries/lease", {"client_id": name})
        if status == 200:
            body = {"client_id": name, "choice": "left"}
            status, _ = _post(web, f"/api/v1/queries/{question['id']}/answer", body)
        if status == 200:
            times.append(1e3 * (time.perf_counter() - began))
        else:
            errors.append(status)
        time.sleep(thinks)
    web.close()


def _post(web: http.client.HTTPConnection, path: str, body: dict[str, Any]) -> tuple[int, Any]:
    web.request("POST", path, json.dumps(body), {"Content-Type": "application/json"})
    reply = web.getresponse()
    content = reply.read()
    return reply.status, json.loads(content) if content else None


def measure(parents: int, thinks: float, seconds: float) -> Measured:
    """One crowd before a web process of its own."""
    with tempfile.TemporaryDirectory() as name:
        data, port = Path(name), free_port()
        settings = Settings(data=data, database_url=None)
        db = migrated(settings)
        run = start(db, NewRun(world="unsafe-exploration", config={})).id
        with db.write() as session:  # at once: each by itself would wait for the disk
            session.add_all(
                Query(run_id=run, tick=tick, kind="guidance", maturity=1, clips=CLIPS, posted=db.clock())
                for tick in range(int(QUESTIONS_A_SECOND * seconds))
            )
        db.close()
        with command("web", "--port", str(port), settings=settings):
            until_up(f"http://127.0.0.1:{port}")
            before = commits(data, 1)
            times, errors = answered(port, run, parents, thinks, seconds)
            yardstick = (before + commits(data, 1)) / 2
    ranked = sorted(times)
    p99 = ranked[-(-99 * len(ranked) // 100) - 1]
    return Measured(parents, thinks, len(ranked) / seconds, yardstick, median(ranked), p99, errors)


def answered(port: int, run: int, parents: int, thinks: float, seconds: float) -> tuple[list[float], int]:
    """The milliseconds of each answer of a crowd, and how many requests got something else than 200."""
    context = multiprocessing.get_context("fork")
    out, end = context.Queue(), time.monotonic() + seconds
    names = [f"parent-{number}" for number in range(parents)]
    crowds = [
        context.Process(target=crowd, args=(port, run, names[number::PROCESSES], thinks, end, out))
        for number in range(PROCESSES)
    ]
    for one in crowds:
        one.start()
    found = [out.get() for _ in crowds]
    for one in crowds:
        one.join()
    return [time_ for times, _ in found for time_ in times], sum(errors for _, errors in found)


def main() -> None:
    """Print a row for each crowd."""
    parser = argparse.ArgumentParser(description="Answers a second of many parents at once.")
    parser.add_argument("--seconds", type=float, default=10, help="of each crowd [default: 10]")
    said = parser.parse_args()
    heads = {"parents": 8, "thinks": 8, "answers/s": 10, "commits/s": 11, "ratio": 8}
    heads |= {"p50 ms": 8, "p99 ms": 8, "errors": 8}
    print("".join(f"{head:>{width}}" for head, width in heads.items()))
    for parents, thinks in ((CLOSED, 0.0), (THINKING, 1.0)):
        print(measure(parents, thinks, said.seconds), flush=True)


if __name__ == "__main__":
    main()
