"""Answers a second of many parents at once, as a ratio to a yardstick taken at the same moment.

    python -m benchmarks.parents    64 parents without a pause, then 50 that think for about a second
    python -m benchmarks.parents --store postgresql    the same, without syncs (`fsync=off`)

A web process serves a run of which 500 questions wait at any time. Each parent leases one, answers it and
goes on, over a connection of its own; all parents live in two other processes. The yardstick is the durable
commits a second of one connection to a database beside it, before and after. On a machine with other work
only the ratio says something, and the processor time of the web process for each answer, its lease included.
Our minimum of the ratio is 0.25 (docs/reliability.md).
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import random
import re
import selectors
import socket
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple
from unittest.mock import patch

from sqlalchemy import select

from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.settings import Settings
from parenting.server.store.sqlite import PRAGMAS, sqlite_module
from parenting.server.tables import Query, Run
from tests.access import bearer
from tests.database import STORES, database_url, migrated
from tests.server.conftest import CLIPS
from tests.server.processes import command
from tests.server.serving import free_port, until_up

CLOSED, THINKING, PROCESSES = 64, 50, 2
OPEN, REFILL_SECONDS = 500, 0.25
"""Questions that wait, and how often those that were answered are replaced: no parent ever waits for one."""
FIRST_ID, LENGTH = re.compile(rb'"id":(\d+)'), re.compile(rb"content-length: (\d+)", re.IGNORECASE)


class Measured(NamedTuple):
    """Answers of one crowd of parents."""

    parents: int
    thinks: float
    answers: float  # a second
    yardstick: float  # commits a second
    p50: float  # milliseconds from a lease to the reply to its answer
    p99: float
    errors: Counter[int]  # the statuses of replies other than 200; 204: no question waited
    cost: float  # milliseconds of a processor that the web process spends on an answer

    def __str__(self) -> str:
        """A row of the table."""
        ratio = f"{self.answers / self.yardstick:8.3f}"
        times = f"{self.p50:8.0f}{self.p99:8.0f}{self.errors.total():8}{self.cost:8.2f}"
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
    """Parents in one process: put their times and the statuses of their errors into `out`."""
    times, errors = list[float](), list[int]()
    threads = [
        threading.Thread(target=parent, args=(port, run, name, thinks, end, times, errors)) for name in names
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    out.put((times, Counter(errors)))


def parent(
    port: int, run: int, name: str, thinks: float, end: float, times: list[float], errors: list[int]
) -> None:
    """Lease, answer, think, until the end."""
    lease, asks = f"/api/v1/runs/{run}/queries/lease", f'{{"client_id": "{name}"}}'
    body = f'{{"client_id": "{name}", "choice": "left"}}'
    moment = random.Random(name)
    time.sleep(thinks * moment.random())
    with socket.create_connection(("127.0.0.1", port), timeout=30) as web:
        while time.monotonic() < end:
            began = time.perf_counter()
            status, reply = _reply(web, _request(port, lease, asks))
            if status == 200:
                number = FIRST_ID.search(reply).group(1).decode()  # type: ignore[union-attr]  # a 200 has one
                status, _ = _reply(web, _request(port, f"/api/v1/queries/{number}/answer", body))
            if status == 200:
                times.append(1e3 * (time.perf_counter() - began))
            else:
                errors.append(status)
            time.sleep(thinks * moment.uniform(0.5, 1.5))  # else all come at the same moment


def _request(port: int, path: str, body: str) -> bytes:
    head = f"POST {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
    head += f"Authorization: {bearer(port)}\r\n"
    return f"{head}Content-Length: {len(body)}\r\n\r\n{body}".encode()


def _reply(web: socket.socket, request: bytes) -> tuple[int, bytes]:
    """Send a request and return status and body. A client of the standard library costs the server's time."""
    web.sendall(request)
    received = b""
    while b"\r\n\r\n" not in received:
        received += _some(web)
    head, _, body = received.partition(b"\r\n\r\n")
    length = LENGTH.search(head)
    while length is not None and len(body) < int(length.group(1)):
        body += _some(web)
    return int(head[9:12]), body


def _some(web: socket.socket) -> bytes:
    received = web.recv(65536)
    if not received:
        raise ConnectionError("The server closed the connection.")
    return received


def measure(parents: int, thinks: float, seconds: float, store: str, streams: int = 0) -> Measured:
    """One crowd before a web process of its own, perhaps with streams of the run beside it."""
    with tempfile.TemporaryDirectory() as name, database_url(store) as url:
        data, port = Path(name), free_port()
        settings = Settings(data=data, database_url=url)
        db = migrated(settings)
        run = start(db, NewRun(world="unsafe-exploration", config={})).id
        questions = Questions(db, run)
        with (
            patch.dict(os.environ, {"PARENTING_STREAMS": "1000"}),
            command("web", "--port", str(port), settings=settings) as web,
        ):
            until_up(f"http://127.0.0.1:{port}")
            watching = followed(port, run, streams)
            before = commits(data, 1)
            spent = processor_seconds(web.process.pid)
            with questions.kept():
                times, errors = answered(port, run, parents, thinks, seconds)
            spent = processor_seconds(web.process.pid) - spent
            yardstick = (before + commits(data, 1)) / 2
            watching.kill()
            watching.join()
        db.close()
    ranked = sorted(times)
    p99 = ranked[-(-99 * len(ranked) // 100) - 1]
    return Measured(
        parents,
        thinks,
        len(ranked) / seconds,
        yardstick,
        median(ranked),
        p99,
        errors,
        1e3 * spent / len(ranked),
    )


def followed(port: int, run: int, streams: int) -> Any:
    """A process with so many open streams of a run, all of which it reads."""
    one = multiprocessing.get_context("fork").Process(target=_follow, args=(port, run, streams), daemon=True)
    one.start()
    time.sleep(2.0 if streams else 0.0)
    return one


def _follow(port: int, run: int, streams: int) -> None:
    named = f"Host: 127.0.0.1\r\nAuthorization: {bearer(port)}"
    head = f"GET /api/v1/runs/{run}/events HTTP/1.1\r\n{named}\r\n\r\n".encode()
    with selectors.DefaultSelector() as readable:
        for _ in range(streams):
            stream = socket.create_connection(("127.0.0.1", port))
            stream.sendall(head)
            first = stream.recv(65536)
            assert first.startswith(b"HTTP/1.1 200"), first[:200]
            readable.register(stream, selectors.EVENT_READ)
        while streams:
            for key, _ in readable.select():
                key.fileobj.recv(65536)  # type: ignore[union-attr]  # it is a socket
            time.sleep(0.01)  # many at once: the reader is not what is measured


def processor_seconds(process: int) -> float:
    """Return the processor time of a process so far, in user and system mode."""
    fields = Path(f"/proc/{process}/stat").read_text("ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Questions:
    """The questions of a run that wait for parents, as many as there were."""

    def __init__(self, db: Database, run: int) -> None:
        self.db, self.run, self.posted, self.end = db, run, 0, threading.Event()
        self.refill(OPEN)

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Replace the answered ones within the block."""
        thread = threading.Thread(target=self._keep)
        thread.start()
        yield
        self.end.set()
        thread.join()

    def _keep(self) -> None:
        while not self.end.wait(REFILL_SECONDS):
            with self.db.read() as session:
                answered = session.scalars(select(Run.answers).where(Run.id == self.run)).one()
            self.refill(OPEN + answered - self.posted)

    def refill(self, number: int) -> None:
        """Post questions, at once: each by itself would wait for the disk."""
        now = self.db.clock()
        with self.db.write(durable=False) as session:
            session.add_all(
                Query(
                    run_id=self.run,
                    tick=tick,
                    kind="guidance",
                    maturity=1,
                    clips=CLIPS,
                    posted=now,
                )
                for tick in range(self.posted, self.posted + number)
            )
        self.posted += number


def answered(
    port: int, run: int, parents: int, thinks: float, seconds: float
) -> tuple[list[float], Counter[int]]:
    """The milliseconds of each answer of a crowd, and the statuses of requests that got another than 200."""
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
    return [time_ for times, _ in found for time_ in times], sum((errors for _, errors in found), Counter())


def main() -> None:
    """Print a row for each crowd."""
    parser = argparse.ArgumentParser(description="Answers a second of many parents at once.")
    parser.add_argument("--seconds", type=float, default=10, help="of each crowd [default: 10]")
    parser.add_argument("--store", choices=STORES, default="sqlite", help="of the answers [default: sqlite]")
    said = parser.parse_args()
    heads = {"parents": 8, "thinks": 8, "answers/s": 10, "commits/s": 11, "ratio": 8}
    heads |= {"p50 ms": 8, "p99 ms": 8, "errors": 8, "cpu ms": 8}
    print("".join(f"{head:>{width}}" for head, width in heads.items()))
    for parents, thinks in ((CLOSED, 0.0), (THINKING, 1.0)):
        print(measure(parents, thinks, said.seconds, said.store), flush=True)


if __name__ == "__main__":
    main()
