"""Many processes on one database: killed at random statements, and racing for one query.

Nothing told is lost (A1), one answer stands a query and one client wins a race (A2), numbers have no gaps.
"""

from __future__ import annotations

import random
import signal
import threading
from typing import Any

import pytest

from parenting.server.db import Database, connect
from parenting.server.errors import Conflict
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.settings import Settings
from tests.faults.auditor import Store, audit
from tests.faults.clients import live
from tests.faults.figures import Figures
from tests.faults.ledger import read
from tests.faults.points import marked
from tests.lengths import length
from tests.server.conftest import CLIPS
from tests.server.processes import _context

pytestmark = [pytest.mark.torture, pytest.mark.timeout(length(1800, 20000))]
KILLS, AT_ONCE = {"sqlite": length(100, 20_000), "postgresql": length(25, 6000)}, 3
MOMENTS = 160
"""A client dies within so many statements and commits: eight rounds."""
SELDOM = 10
"""One that dies at a given place, within so many passages of it."""
KILLED = "SIGKILLs of database clients"
WINDOWS = {"before COMMIT", "after COMMIT", "after INSERT", "after UPDATE"}
"""Places where a kill must have fallen."""
RACES, RACERS = {"sqlite": length(500, 20_000), "postgresql": length(500, 5000)}, 4


def test_clients_killed_at_random_statements(
    settings: Settings, store: str, mine: Claim, kept: Store, rng: random.Random, figures: Figures
) -> None:
    def begin(number: int, place: str | None = None) -> Any:
        moments = rng.randint(1, MOMENTS if place is None else SELDOM)
        order = (str(settings.data), settings.database_url, mine, number, rng.random(), moments, place)
        process = _context().Process(target=live, args=order, daemon=True)
        process.start()
        return process

    def fell(place: int, process: Any) -> None:
        process.join(60)
        assert process.exitcode == -signal.SIGKILL
        figures.count(KILLED, marked(settings.data / f"client-{place}.mark"))

    kills = KILLS[store]
    living = {number: begin(number) for number in range(1, AT_ONCE + 1)}
    for number in range(1, kills + 1):
        place = next(iter(living))
        fell(place, living.pop(place))
        if number + AT_ONCE <= kills:
            living[number + AT_ONCE] = begin(number + AT_ONCE)
    for number, window in enumerate(sorted(WINDOWS), kills + 1):  # a few dozen kills may all miss one
        fell(number, begin(number, window))
    ledgers = sorted(settings.data.glob("ledger-*"))
    entries = read(*ledgers)
    assert len(entries.told) > kills / 5
    assert audit(kept, entries) == []
    fallen = figures.of(KILLED)
    assert set(fallen) >= WINDOWS, fallen


def test_races_for_one_query_have_one_winner(
    settings: Settings,
    store: str,
    db: Database,
    mine: Claim,
    kept: Store,
    rng: random.Random,
    figures: Figures,
) -> None:
    """Two threads share a database handle, and its lock; two have handles of their own."""
    others = [db, db, connect(settings), connect(settings)]
    races = RACES[store]
    gate, done = threading.Barrier(RACERS + 1), threading.Barrier(RACERS + 1)
    query, won = [0], list[tuple[int, str]]()
    lost: list[str] = []

    def race(number: int) -> None:
        for _ in range(races):
            gate.wait(60)
            choice = "left" if number % 2 else "right"
            try:
                answer(others[number], query[0], choice, f"racer-{number}", "human")
                won.append((query[0], choice))
            except Conflict as error:
                lost.append(error.message)
            done.wait(60)

    threads = [threading.Thread(target=race, args=(number,), daemon=True) for number in range(RACERS)]
    for thread in threads:
        thread.start()
    for tick in range(races):
        query[0] = post_query(db, mine, tick, "guidance", 1, CLIPS)
        gate.wait(60)
        done.wait(60)
    for thread in threads:
        thread.join(60)
    for other in others[2:]:
        other.close()
    assert len(won) == races
    assert len(lost) == races * (RACERS - 1)
    assert all("already answered" in message for message in lost), "a loser is told why"
    stored = kept.rows("SELECT query_id, choice FROM answer ORDER BY query_id")
    assert [(row["query_id"], row["choice"]) for row in stored] == won
    figures.count("races", f"one answer, {RACERS} clients", races)


def test_races_for_a_lease_have_one_winner(
    settings: Settings, store: str, db: Database, mine: Claim, rng: random.Random, figures: Figures
) -> None:
    """One open query at a time: one client gets it, the others nothing (B1)."""
    handles = [db, connect(settings)]
    races = RACES[store] // 5
    for tick in range(races):
        query, found = post_query(db, mine, tick, "guidance", 1, CLIPS), list[int]()
        gate = threading.Barrier(RACERS)

        def race(number: int, gate: threading.Barrier = gate, found: list[int] = found) -> None:
            gate.wait(60)
            held = lease(handles[number % 2], mine.run_id, f"racer-{number}")
            found.extend([held.id] if held is not None else [])

        threads = [threading.Thread(target=race, args=(number,)) for number in range(RACERS)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
        assert found == [query]
        answer(db, query, "left", "winner", "human")
    handles[1].close()
    figures.count("races", f"one lease, {RACERS} clients", races)
