"""SIGKILL of web, worker and the answering scripts while they train a run in every world.

No answer is lost, none is counted twice, and the bits are those of runs that nobody disturbed.

Every CI run kills 24 times; `make torture` kills 240 times, in ten rounds with other moments each. By hand, a
hundred rounds, 2,400 kills in about an hour:

    PARENTING_KILL_ROUNDS=100 pytest -n 0 tests/faults/test_killed.py
"""

from __future__ import annotations

import json
import os
import random
import time
from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest
from sqlalchemy import func, select

from parenting.server.db import Database
from parenting.server.settings import Settings
from parenting.server.tables import Answer
from tests.lengths import length
from tests.server.processes import Command, store_of
from tests.server.raising import Begun
from tests.server.serving import free_port
from tests.server.test_same_bits import GOAL, RUNS, answering, begin, check, until_heard

ROUNDS = int(os.environ.get("PARENTING_KILL_ROUNDS", length(1, 10)))
KILLED = [("sqlite", 1), ("sqlite", 2), ("postgresql", 1), ("postgresql", 2)]
"""Stores with numbers of stages. In every run test_kills.py kills, on both stores."""
KILLS = 12
"""So many in a round at T = 1, and as many at T = 2."""
KINDS = ["web", "worker", "script"]
SOON = 0.15
"""A kill comes up to so many seconds after the answer that it was drawn for: at any place between two."""
PATCHES = {
    "parenting.server.checkpoint_pace.CHECKPOINT_SECONDS": 0.05,
    "parenting.server.checkpoint_pace.QUIET_SECONDS": 0.05,
    "parenting.server.checkpoint_pace.CHECKPOINT_SPEED": 1e12,
    "parenting.server.checkpoint_parts.PART_BYTES": 200_000,
}
"""Checkpoints are written often, so that kills hit them too."""


class House:
    """Web, worker and a script for each run; what ends before its work is done is started again."""

    def __init__(self, settings: Settings, runs: dict[int, Begun]) -> None:
        self.settings, self.url = settings, f"http://127.0.0.1:{free_port()}"
        self.receipt_files = {run: settings.data / f"receipts-{run}.jsonl" for run in runs}
        self.orders: dict[str, tuple[str, ...]] = {
            "web": ("web", "--port", self.url.rpartition(":")[2]),
            "worker": ("worker",),
        }
        self.orders |= {f"script {run}": self.script(run) for run in runs}
        self.commands: dict[str, Command] = {}
        self.killed: Counter[str] = Counter()

    def script(self, run: int) -> tuple[str, ...]:
        return answering(self.url, run, "--receipts", str(self.receipt_files[run]))

    def __enter__(self) -> House:
        return self

    def __exit__(self, *_: object) -> None:
        for one in self.commands.values():
            if one.alive:
                one.kill()

    def keep(self) -> None:
        """Start whatever does not run; a script that came to its end in order is done."""
        for name, order in list(self.orders.items()):
            one = self.commands.get(name)
            if one is not None and one.alive:
                continue
            code = None if one is None else one.process.exitcode
            assert one is None or code != 1, f"{name} gave up: {one.said()}"
            if code == 0 and order[0] == "answer":
                del self.orders[name]
            else:  # killed, or a script that found no server, or a server that found its port taken
                self.commands[name] = Command(
                    *order, data=self.settings.data, patches=PATCHES, environment=store_of(self.settings)
                )

    def kill(self, kind: str, rng: random.Random) -> None:
        """One process of this kind, or of another where none of it lives."""
        living = [name for name in self.orders if name in self.commands and self.commands[name].alive]
        kinds = sorted({name.split()[0] for name in living})
        kind = kind if kind in kinds else rng.choice(kinds)
        self.commands[rng.choice([name for name in living if name.split()[0] == kind])].kill()
        self.killed[kind] += 1

    def receipts(self) -> Iterator[dict[str, Any]]:
        """The lines that the server has sent: a line was written after its reply was read to the end."""
        for file in self.receipt_files.values():
            if file.exists():
                yield from map(json.loads, file.read_text(encoding="utf-8").splitlines())


def stored(db: Database) -> int:
    with db.read() as session:
        return session.scalar(select(func.count()).select_from(Answer)) or 0


def disturb(db: Database, house: House, moments: Iterator[float], rng: random.Random) -> None:
    """Kill at each moment, a number of stored answers, and let the rest come to its end."""
    end, moment, kinds = (
        time.monotonic() + 400,
        next(moments, None),
        rng.sample(KINDS, counts=[KILLS // 3] * 3, k=KILLS),
    )
    while any(order[0] == "answer" for order in house.orders.values()):
        assert time.monotonic() < end, f"{stored(db)} answers, killed: {house.killed}"
        house.keep()
        if moment is not None and stored(db) >= moment:
            time.sleep(rng.uniform(0, SOON))
            house.kill(kinds[house.killed.total()], rng)
            moment = next(moments, None)
        time.sleep(0.01)


@pytest.mark.slow
@pytest.mark.torture
@pytest.mark.timeout(900)
@pytest.mark.parametrize(("store", "stages"), KILLED, indirect=["store"])
@pytest.mark.parametrize("seed", range(ROUNDS))
def test_killed_at_random_moments(settings: Settings, db: Database, seed: int, stages: int) -> None:
    rng = random.Random(10 * seed + stages)
    runs = begin(db, [begun for begun in RUNS if begun.config.max_clip_length == stages])
    moments = sorted(rng.uniform(0, len(runs) * (GOAL - 2)) for _ in range(KILLS))
    with House(settings, runs) as house:
        disturb(db, house, iter(moments), rng)
        assert house.killed.total() == KILLS
        assert set(house.killed) == set(KINDS)
        until_heard(db, runs)
        house.keep()
        assert house.commands["worker"].stop() == 0
        told = list(house.receipts())
    hold_to_the_receipts(db, told, runs)
    for run, begun in runs.items():
        check(db, run, begun)


def hold_to_the_receipts(db: Database, told: list[dict[str, Any]], runs: dict[int, Begun]) -> None:
    """Every receipt is in the database; every question has one answer, and every answer its own number."""
    with db.read() as session:
        rows = session.scalars(select(Answer)).all()
    found = {(row.run_id, row.number): (row.query_id, row.choice) for row in rows}
    assert len(found) == len({row.query_id for row in rows}) == len(rows) == len(runs) * GOAL
    for receipt in told:
        assert found[receipt["run"], receipt["number"]] == (receipt["query"], receipt["choice"])
    assert len({(receipt["run"], receipt["number"]) for receipt in told}) == len(told)
    assert len(told) > len(rows) - KILLS  # a script that is killed may have no time to write its last down
