"""The processor time and the statements that a web process spends on an answer of a crowd that thinks.

    python -m benchmarks.crowd_web                              50 people, 15 answers a second in all, 10 s
    python -m benchmarks.crowd_web --people 12 --store postgresql

Fifty people answer a run each: each request for a question waits at the server until there is one, as those
of `parenting answer --people` do. The application is called in this process, without a socket, and one thread
plays all workers: it hears each answer and asks the next question. Its processor time is taken off; that of
the people is not, which is the same in all versions. So the figures depend on the machine's speed but little
on its other work; the number of statements depends on neither.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import logging
import random
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import httpx2
import structlog
from sqlalchemy import event, text

from parenting.server.app import create_app
from parenting.server.db import Database, connect
from parenting.server.new_run import NewRun, start
from parenting.server.notify import Notifier
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.runs import claim
from parenting.server.settings import Settings
from tests import access
from tests.database import STORES, database_url, migrated
from tests.postgres import cluster
from tests.server.conftest import CLIPS

WAIT = 5.0
"""Seconds for which a request for a question lies at the server."""
WARM = 2.0
"""Seconds that are not counted."""
PAUSE = 0.02
"""Seconds between two looks of the thread that plays the workers."""


class Workers(threading.Thread):
    """One thread that asks the next question of every run whose last one is answered."""

    def __init__(self, settings: Settings) -> None:
        super().__init__(daemon=True)
        self.db, self.notifier = connect(settings), Notifier(settings.data, "web")
        self.claims = {one.run_id: one for one in claim(self.db, "benchmark")}
        self.ticks, self.end, self.spent = dict.fromkeys(self.claims, 0), threading.Event(), 0.0

    def run(self) -> None:
        for run in self.claims:
            self.ask(run)
        while not self.end.wait(PAUSE):
            with self.db.read() as session:
                answered = session.execute(text("SELECT run_id FROM query WHERE status = 'answered'"))
                due = set(answered.scalars())
            for run in due:
                take_answer(self.db, self.claims[run], self.ticks[run] + 1)
                self.ask(run)
            self.spent = time.thread_time()
        self.db.close()

    def ask(self, run: int) -> None:
        """Post the next question of a run."""
        self.ticks[run] += 2
        post_query(self.db, self.claims[run], self.ticks[run], "guidance", 1, CLIPS)
        self.notifier.notify(run)


class Crowd:
    """People before an application."""

    def __init__(self, app: Any, runs: Sequence[str], each: float) -> None:
        self.runs, self.each, self.answered, self.until = runs, each, 0, 0.0
        self.transport = httpx2.ASGITransport(app)

    async def answer(self, seconds: float) -> None:
        """Answer for so many seconds, and then until everybody has answered once more."""
        self.answered, self.until = 0, time.monotonic() + seconds
        await asyncio.gather(*(self._live(at, run) for at, run in enumerate(self.runs)))

    async def _live(self, at: int, run: str) -> None:
        draws, name = random.Random(at), f"person-{at}"
        url = "http://127.0.0.1:8000/api/v1"
        async with httpx2.AsyncClient(transport=self.transport, auth=access.Proof(), timeout=60) as http:
            while time.monotonic() < self.until:
                asks = {"client_id": name, "wait": WAIT}
                asked = await http.post(f"{url}/runs/{run}/queries/lease", json=asks)
                asked.raise_for_status()
                if asked.status_code == 204:
                    continue
                await asyncio.sleep(draws.expovariate(1 / self.each))
                says = {"client_id": name, "choice": "left", "parent": "scripted"}
                said = await http.post(f"{url}/queries/{asked.json()['public_id']}/answer", json=says)
                said.raise_for_status()
                self.answered += 1


def measure(store: str, people: int, rate: float, seconds: float) -> None:
    """Print the figures of one crowd."""
    with tempfile.TemporaryDirectory() as folder, database_url(store) as url:
        settings = Settings(data=Path(folder), database_url=url)
        access.seed(settings.data)
        db = migrated(settings)
        started = [start(db, NewRun(world="unsafe-exploration", seed=seed)) for seed in range(people)]
        app = create_app(settings, db)
        crowd = Crowd(app, [run.public_id for run in started], people / rate)
        asyncio.run(_measured(app, crowd, db, Workers(settings), seconds))


async def _measured(app: Any, crowd: Crowd, db: Database, workers: Workers, seconds: float) -> None:
    statements: list[str] = []
    async with app.router.lifespan_context(app):
        workers.start()
        await crowd.answer(WARM)
        event.listen(db.engine, "before_cursor_execute", lambda *told: statements.append(told[2]))
        before = time.process_time() - workers.spent
        await crowd.answer(seconds)
        spent = time.process_time() - workers.spent - before
        workers.end.set()
        workers.join()
    each = {"ms of the processor": 1e3 * spent, "statements": len(statements)}
    print(json.dumps({name: round(found / crowd.answered, 2) for name, found in each.items()}), flush=True)


def main() -> None:
    """Measure what is chosen."""
    parser = argparse.ArgumentParser(description="What a web process spends on an answer of a crowd.")
    parser.add_argument("--people", type=int, default=50)
    parser.add_argument("--rate", type=float, default=15.0, help="answers a second of all [default: 15]")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--store", choices=STORES, default="sqlite")
    said = parser.parse_args()
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.WARNING))
    if said.store == "postgresql":
        cluster()
    measure(said.store, said.people, said.rate, said.seconds)


if __name__ == "__main__":
    main()
