"""The waits and costs of a crowd, beside the durable commits a second of one connection.

    python -m benchmarks.crowd                              every part, both stores, about fifteen minutes
    python -m benchmarks.crowd people flat --quick          two parts, shorter
    python -m benchmarks.crowd --store sqlite --workers 3
    python -m benchmarks.crowd people --people 20           how many people these cores carry

| part | what it does | bars |
|---|---|---|
| people | 50 people who think for a second answer a run each; a web process and two workers | next guidance question p50 250 ms, p99 1 s; answer p99 100 ms; growth 1.5 MB in 1,000 answers beside checkpoints |
| fair | 8 people who do not think answer 8 equal runs | most to least answers of a run 1.5 |
| flat | 64 people who do not think answer questions that wait already; no worker | 0.25 of the yardstick |
| streams | the same with 200 event streams beside them, in turn with none | 10 % fewer answers |
| waiting | 1,000 runs wait for their parents (`benchmarks.waiting_runs`; SQLite) | 2 % of a core, 600 MB, p99 150 ms |

The yardstick is taken while a part goes on: a fifth of a second in every four of *people* and *fair*, before
and after *flat* and *streams*. On a machine with other work compare ratios to it, and runs of two versions
in turn. PostgreSQL is a cluster as the tests start it (`tests/postgres.py`), so without syncs.
"""  # noqa: E501 (a table)

from __future__ import annotations

import argparse
import json
import os
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import psycopg
from sqlalchemy import text

from benchmarks import parents, waiting_runs
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.settings import Settings
from tests.database import STORES, database_url, migrated
from tests.postgres import cluster
from tests.server.processes import Command, store_of
from tests.server.serving import free_port, until_up

WORLD = "unsafe-exploration"
EVERY, FOR = 4.0, 0.2
"""Seconds between two looks at the yardstick, and of each."""
MEGABYTE = 1e6


class Size(NamedTuple):
    """The size of each part."""

    people: int = 50
    seconds: float = 60.0
    fair: int = 8
    flat: int = 64
    streams: int = 200
    turns: int = 3
    waiting: int = 1000


QUICK = Size(seconds=25, turns=1, waiting=60)
"""As many people and streams, but for a shorter time: all parts of both stores in less than four minutes."""


class Yardstick:
    """Durable commits a second of one connection to the same disk, or to the same server."""

    def __init__(self, settings: Settings) -> None:
        self.settings, self.found, self._end = settings, list[float](), threading.Event()

    def take(self, seconds: float) -> float:
        """Return the commits a second of so many seconds."""
        if self.settings.database_url is None:
            return parents.commits(self.settings.data, seconds)
        url = self.settings.database_url.replace("postgresql+psycopg", "postgresql")
        with psycopg.connect(url, autocommit=True) as store:
            store.execute("CREATE TABLE IF NOT EXISTS yardstick (word text)")
            began, done = time.perf_counter(), 0
            while time.perf_counter() - began < seconds:
                store.execute("INSERT INTO yardstick VALUES ('a')")
                done += 1
            return done / (time.perf_counter() - began)

    @contextmanager
    def beside(self) -> Iterator[None]:
        """Take it again and again within the block."""
        thread = threading.Thread(target=self._keep)
        thread.start()
        try:
            yield
        finally:
            self._end.set()
            thread.join()

    def _keep(self) -> None:
        while not self._end.wait(EVERY):
            self.found.append(self.take(FOR))


class Served(NamedTuple):
    """A crowd's server: the database, its settings, the address, and the processes of web and workers."""

    db: Database
    settings: Settings
    url: str
    pids: list[int]

    def spent(self) -> tuple[float, float]:
        """Return the processor seconds so far of the web, and of all workers."""
        web, *workers = [parents.processor_seconds(pid) for pid in self.pids]
        return web, sum(workers)


@contextmanager
def served(store: str, runs: int, workers: int) -> Iterator[Served]:
    """So many runs, each of which has asked, a web process and some workers."""
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        settings = Settings(data=Path(folder), database_url=stack.enter_context(database_url(store)))
        db = migrated(settings)
        stack.callback(db.close)
        for seed in range(runs):
            start(db, NewRun(world=WORLD, parent="human", seed=seed, config={}))
        port = free_port()
        environment = store_of(settings) | {"PARENTING_CLAIM_SECONDS": "5"}
        commands = [("web", "--port", str(port)), *[("worker",)] * workers]
        processes = [Command(*told, data=settings.data, environment=environment) for told in commands]
        for process in processes:
            stack.callback(process.kill)
        until_up(url := f"http://127.0.0.1:{port}")
        waiting_runs.until_all_wait(db, runs)
        yield Served(db, settings, url, [process.process.pid for process in processes])


def crowd(settings: Settings, url: str, people: int, think: float, seconds: float) -> dict[str, Any]:
    """Return the figures of `parenting answer --people`."""
    told = ("--people", str(people), "--think", str(think), "--seconds", str(seconds), "--json")
    bots = Command("answer", "--url", url, *told, data=settings.data)
    assert bots.wait(seconds + 120) == 0, bots.said()
    found: dict[str, Any] = json.loads(bots.said().splitlines()[-1])
    return found


def stored(db: Database, store: str) -> float:
    """Return the megabytes of the database without its checkpoints and the rows of the yardstick."""
    with db.read() as session:
        if store == "postgresql":
            whole = session.scalar(text("SELECT pg_database_size(current_database())"))
            others = "relname IN ('checkpoint', 'checkpoint_part', 'yardstick') AND relkind = 'r'"
            sizes = f"SELECT sum(pg_total_relation_size(oid)) FROM pg_class WHERE {others}"
            return float(whole - session.scalar(text(sizes))) / MEGABYTE
        names = ("page_size", "page_count", "freelist_count")
        size, pages, free = (session.scalar(text(f"PRAGMA {name}")) for name in names)
        parts = "(SELECT coalesce(sum(length({0})), 0) FROM {1})"
        blobs = f"{parts.format('blob', 'checkpoint')} + {parts.format('blob', 'checkpoint_part')}"
        return float(size * (pages - free) - session.scalar(text(f"SELECT {blobs}"))) / MEGABYTE


def people(store: str, size: Size, workers: int) -> None:
    """Fifty people who think."""
    with served(store, size.people, workers) as up:
        yardstick, before, spent = Yardstick(up.settings), stored(up.db, store), up.spent()
        with yardstick.beside():
            found = crowd(up.settings, up.url, size.people, 1.0, size.seconds)
        answered, after = max(found["answered"], 1), up.spent()
        grown = stored(up.db, store) - before
    guidance, answer = found["next_guidance_ms"], found["answer_ms"]
    line("next guidance p50, ms", guidance["p50"], 250)
    line("next guidance p99, ms", guidance["p99"], 1000)
    line("answer p99, ms", answer["p99"], 100)
    line("growth, MB in 1,000 answers", 1000 * grown / answered, 1.5)
    web, raised = (1e3 * (after[place] - spent[place]) / answered for place in (0, 1))
    print(f"    processor ms an answer: web {web:.1f}, workers {raised:.1f}", flush=True)
    tell(f"{found['per_second']} answers/s, {len(found['errors'])} kinds of errors", yardstick)


def fair(store: str, size: Size, workers: int) -> None:
    """People who do not think, and equal runs."""
    with served(store, size.fair, workers) as up:
        yardstick = Yardstick(up.settings)
        with yardstick.beside():
            found = crowd(up.settings, up.url, size.fair, 0.0, size.seconds / 2)
    most, least = found["most_of_a_run"], found["least_of_a_run"]
    line("most to least answers of a run", most / max(least, 1), 1.5)
    tell(f"{least} to {most} answers a run, {found['per_second']} answers/s", yardstick)


def flat(store: str, size: Size, _workers: int) -> None:
    """People who do not think, and questions that wait."""
    found = parents.measure(size.flat, 0.0, size.seconds / 6, store)
    least("answers to commits", found.answers / found.yardstick, 0.25)
    rates = f"{found.answers:.0f} answers/s, yardstick {found.yardstick:.0f} commits/s"
    cost = f"{found.cost:.2f} ms of the web's processor an answer"
    replies = ", ".join(f"{number} of {status}" for status, number in found.errors.items())
    errors = f"replies other than 200: {replies or 'none'}"
    print(f"    {rates}, p99 {found.p99:.0f} ms, {errors}, {cost}", flush=True)


def streams(store: str, size: Size, _workers: int) -> None:
    """The same with streams, in turn with none."""
    found: dict[int, list[float]] = {0: [], size.streams: []}
    for _ in range(size.turns):
        for number, rates in found.items():
            one = parents.measure(size.flat, 0.0, size.seconds / 8, store, streams=number)
            rates.append(one.answers)
            rate = f"{one.answers:.0f} answers/s ({one.yardstick:.0f} commits/s)"
            print(f"    {number:4} streams: {rate}, {one.cost:.2f} ms of processor an answer", flush=True)
    without, with_them = median(found[0]), median(found[size.streams])
    line("fewer answers with streams, %", 100 * (1 - with_them / without), 10)


def waiting(store: str, size: Size, _workers: int) -> None:
    """Runs that wait."""
    if store != "sqlite":
        print("    on SQLite alone", flush=True)
        return
    waiting_runs.measure(size.waiting, 100 if size.waiting > 500 else 20, size.seconds / 2, 0.3)


def line(name: str, found: float, most: float) -> None:
    """Print a figure that is to be small, and its bar."""
    print(f"  {name:34}{found:10.2f}  bar {most:g}: {'met' if found <= most else 'NOT met'}", flush=True)


def least(name: str, found: float, bar: float) -> None:
    """Print a figure that is to be large, and its bar."""
    print(f"  {name:34}{found:10.3f}  bar {bar:g}: {'met' if found >= bar else 'NOT met'}", flush=True)


def tell(words: str, yardstick: Yardstick) -> None:
    """Print words without a bar, and the yardstick."""
    found = yardstick.found
    beside = f"{median(found):.0f} ({min(found):.0f} to {max(found):.0f})" if found else "not taken"
    print(f"    {words}; yardstick {beside} commits/s", flush=True)


PARTS: dict[str, Callable[[str, Size, int], None]] = {
    "people": people,
    "fair": fair,
    "flat": flat,
    "streams": streams,
    "waiting": waiting,
}


def main() -> None:
    """Measure what is chosen."""
    parser = argparse.ArgumentParser(description="The waits and costs of a crowd.")
    parser.add_argument("parts", nargs="*", help=f"{', '.join(PARTS)} [default: all]")
    parser.add_argument("--store", choices=STORES, action="append", help="repeatable [default: both]")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--people", type=int, default=Size().people, help="in part people [default: 50]")
    parser.add_argument("--quick", action="store_true", help="shorter, and fewer runs that wait")
    said = parser.parse_args()
    if said.people < 1:
        parser.error(f"--people: {said.people} is less than 1.")
    unknown = set(said.parts) - set(PARTS)
    if unknown:
        parser.error(f"There is no part {min(unknown)!r}. There are {', '.join(PARTS)}.")
    size = (QUICK if said.quick else Size())._replace(people=said.people)
    for store in said.store or STORES:
        if store == "postgresql":
            cluster()
        for part in said.parts or PARTS:
            load = os.getloadavg()[0]
            print(f"{part}, {store}, {os.cpu_count()} cores, load average {load:.1f}", flush=True)
            PARTS[part](store, size, said.workers)


if __name__ == "__main__":
    main()
