"""The growth of a database by answers, table by table, on either store.

    python -m benchmarks.growth                   1,000 answers in each of two worlds, about a minute
    python -m benchmarks.growth --answers 100     fewer
    python -m benchmarks.growth --runs 12 --people --store postgresql

Parents raise conservative agents as a worker does, the agents in turn: a script, or with `--people` persons
as the web serves them, who hold each question before they answer it, with measures. `--answers` is the number
of answers in all runs together. The bytes are those of the pages of tables and indexes, less what the
database held after the first five answers of each run. *Least* is the same after the store has written its
tables without any gap: the rest is room in pages, and on PostgreSQL rows of before an update. Checkpoints are
left out of the sum: a run has at most two, however long it lives.

PostgreSQL is a cluster as the tests start it (`tests/postgres.py`), with its autovacuum: it looks once a
second instead of once a minute, as people take an hour for what is played here in a minute.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

import torch

from benchmarks.growth_sizes import Sizes, kept, sizes_of
from parenting.server.db import Database, connect
from parenting.server.migrate import upgrade
from parenting.server.new_run import NewRun, start
from parenting.server.queue.answers import Said, answer_in
from parenting.server.queue.leases import lease
from parenting.server.queue.worker_side import watch
from parenting.server.runs import Claim, claim, get_run
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from tests.database import STORES
from tests.postgres import Cluster

WORLDS = ("unsafe-exploration", "side-effects")
ANSWERS = 1000
FIRST = 5
"""Answers of each run before what is counted: by then each table and index has its first page."""
LEAST = 0.005
"""Megabytes a thousand answers that have a line of their own."""
CHOICES = ("left", "right", "either", "left")
MEASURED = {
    **{"shown": 1_764_460_800_123, "reacted": 640, "answered": 1890, "queued": 12, "away": 0},
    **{"layout": "one", "sides": "left-right", "width": 1280, "height": 800, "input": "key"},
    "wording": "0a1b2c3d",
}
"""The measures of an answer, as the page takes them."""


class Person:
    """A person who answers one run, as the web stores it."""

    def __init__(self, db: Database, run: int) -> None:
        self._db, self._run, self.given = db, run, 0
        self._client = f"{run:08x}-5c1e-4f7a-9d2b-0123456789ab"  # as long as a browser's

    def answer(self) -> None:
        """Answer the question that is open."""
        question = lease(self._db, self._run, self._client)
        assert question is not None, "nothing is asked"
        said = Said(CHOICES[self.given % len(CHOICES)], self._client, "human", 0, MEASURED)
        with self._db.write() as session:
            answer_in(session, self._db, question.id, said)
        self.given += 1


class Life:
    """An agent and its parent."""

    def __init__(self, db: Database, mine: Claim, people: bool) -> None:
        self._db, self._run = db, mine.run_id
        self._session = RunSession(db, mine, get_run(db, mine.run_id), lambda: None)
        self._person = Person(db, mine.run_id) if people else None

    @property
    def heard(self) -> int:
        """Return the number of answers that the agent has heard."""
        return int(self._session.saved.tally.kinds.sum())

    def go_on(self, until: int) -> None:
        """Live until so many answers are heard."""
        while self.heard < until:
            seen = watch(self._db, [self._run])[self._run]
            if self._person is None or self._session.ready(seen):
                self._session.tick(seen)
                continue
            self._session.report_waiting(seen)
            self._person.answer()

    def end(self) -> None:
        """End as a worker does."""
        self._session.end()


def grown(db: Database, world: str, answers: int, runs: int, people: bool) -> Sizes:
    """Raise agents until so many answers are heard; the bytes that this added."""
    parent: Literal["human", "scripted"] = "human" if people else "scripted"
    for seed in range(1, runs + 1):
        start(db, NewRun(world=world, parent=parent, preset="conservative", seed=seed))
    lives = [Life(db, mine, people) for mine in claim(db, "benchmark")]
    _raise(lives, 1, FIRST)
    before = sizes_of(db)
    _raise(lives, FIRST + 1, FIRST + answers // runs)
    for life in lives:
        life.end()
    return sizes_of(db, least=True) - before


def _raise(lives: Sequence[Life], first: int, last: int) -> None:
    for heard in range(first, last + 1):
        for life in lives:
            life.go_on(heard)


@contextmanager
def database(store: str) -> Iterator[Database]:
    """A new database; PostgreSQL's cleans up after itself, as where it is installed."""
    with tempfile.TemporaryDirectory() as folder:
        server = Cluster(autovacuum="on", autovacuum_naptime="1s") if store == "postgresql" else None
        if server is not None:
            server.create("growth")
        db = connect(Settings(data=Path(folder), database_url=server.url("growth") if server else None))
        upgrade(db)
        yield db
        db.close()
        if server is not None:
            server.stop()


def show(found: Mapping[str, tuple[float, float]]) -> None:
    """Print megabytes a thousand answers, those that count little in one line."""
    for name, (now, least) in sorted(found.items(), key=lambda one: -one[1][0]):
        if now >= LEAST:
            print(f"  {name:<40} {now:6.3f} {least:6.3f}{'  (kept: two)' if kept(name) else ''}")
    now, least = (sum(one[place] for name, one in found.items() if not kept(name)) for place in (0, 1))
    print(f"  {'in all, without checkpoints':<40} {now:6.3f} {least:6.3f}\n", flush=True)


def main() -> None:
    """Print a table for each world."""
    parser = argparse.ArgumentParser(description="Megabytes that a thousand answers add to a database.")
    parser.add_argument("--answers", type=int, default=ANSWERS, help="in all runs together")
    parser.add_argument("--runs", type=int, default=1, help="agents that are raised in turn")
    parser.add_argument("--people", action="store_true", help="people answer, not scripts")
    parser.add_argument("--store", choices=STORES, default="sqlite")
    parser.add_argument("--world", choices=WORLDS, action="append", help="repeatable [default: both]")
    said = parser.parse_args()
    if not 1 <= said.runs <= said.answers:
        parser.error(f"--runs {said.runs}: from 1 to --answers {said.answers}, so that each run gets one")
    torch.set_num_threads(1)  # as a worker does
    for world in said.world or WORLDS:
        with database(said.store) as db:
            found = grown(db, world, said.answers, said.runs, said.people)
        asked = f"{said.runs} runs, {'people' if said.people else 'scripts'}, {said.store}"
        print(f"{world}, {said.answers} answers, {asked}: megabytes a thousand answers, and least")
        show(found.each(said.answers))


if __name__ == "__main__":
    main()
