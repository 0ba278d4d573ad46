"""Processes that stop without ending, and replies that get lost on their way."""

from __future__ import annotations

import random
import signal
import time

import pytest

from parenting.server.db import Database
from parenting.server.new_run import start
from parenting.server.settings import Settings
from tests.faults.figures import Figures
from tests.faults.house import House
from tests.faults.points import Point
from tests.faults.proxy import dropping
from tests.faults.rebuilt import rebuild
from tests.lengths import length
from tests.server.raising import ISLAND

pytestmark = [pytest.mark.torture, pytest.mark.timeout(length(1800, 3000))]
INSIDE = Point("inside a write", "after", r'INSERT INTO "?query"?', signal=signal.SIGSTOP)
BETWEEN = Point("between two", "after", r'INSERT INTO "?query"?', commit=True, signal=signal.SIGSTOP)
STOPPED_SECONDS = 7.0
"""Longer than anybody waits for a lock."""
DROPPED = length(25, 1000)


def hold(house: House, runs: list[int]) -> None:
    assert house.audit() == []
    for run in runs:
        assert rebuild(house.store, run) == []


@pytest.mark.slow_on("postgresql")
def test_worker_stopped_inside_a_write_ends_nobody(
    settings: Settings, db: Database, rng: random.Random, figures: Figures
) -> None:
    """The store is busy for everybody meanwhile; the other worker waits, and all go on (D2, C4)."""
    runs = [start(db, ISLAND.new("human")).id for _ in range(2)]
    with House(settings, workers=2, webs=length(1, 2)) as house:
        house.keep()
        house.move_in(runs, 2, rng)
        house.until_told(2)
        for point in (INSIDE, BETWEEN) * length(1, 10):
            house.commands["worker 1"].kill()
            house.commands["worker 2"].kill()
            house.begin("worker 1", point)
            house.until_stopped("worker 1")
            other = house.begin("worker 2")
            time.sleep(STOPPED_SECONDS)
            assert other.alive, f"{other.process.exitcode}: {other.said()}"
            house.signal("worker 1", signal.SIGCONT)
            house.until_told(3)
            assert other.alive, f"{other.process.exitcode}: {other.said()}"
            figures.count("SIGSTOPs", f"worker: {point.name}")
        house.move_out()
        hold(house, runs)


@pytest.mark.slow_on("postgresql")
def test_client_learns_the_truth_after_a_lost_reply(
    settings: Settings, db: Database, rng: random.Random, figures: Figures
) -> None:
    """Answers whose replies were dropped are sent again, and get the reply that was lost (A2, A3)."""
    runs = [start(db, ISLAND.new("human")).id for _ in range(2)]
    with House(settings) as house, dropping(house.url, rng.random()) as proxy:
        house.keep()
        house.url = proxy.url
        house.move_in(runs, 2, rng)
        while proxy.dropped < DROPPED or not sum(parent.resent for parent in house.parents):
            house.until_told(1)  # a lost reply to a request for a question has no answer to send again
        house.move_out()
        figures.count("replies dropped after delivery", "of all requests", proxy.dropped)
        hold(house, runs)
