"""SIGKILL at every named point and at random moments, while parents answer and an operator interferes.

No told answer is lost (A1), none is counted twice (A2), nothing is asked twice (C3), no question is in two
hands (B1), and the state of each agent is what its record gives (A5, C1, C2). A point that no kill hit fails.
"""

from __future__ import annotations

import random
import time

import pytest

from parenting.server.db import Database
from parenting.server.new_run import start
from parenting.server.settings import Settings
from tests.faults.figures import Figures
from tests.faults.house import PATIENCE, House, in_time
from tests.faults.points import CLOSING, GROUP, WEB, WORKER, Point
from tests.faults.rebuilt import entries_of_x, rebuild
from tests.lengths import length
from tests.server.raising import ISLAND

pytestmark = [pytest.mark.torture, pytest.mark.timeout(length(1800, 6000))]
RUNS, PARENTS, CROWD = 2, 2, 8
KILLS = {"sqlite": length(15, 3000), "postgresql": length(9, 600)}
SAMPLED = 6
"""Points that a run of CI tries on PostgreSQL; on SQLite it tries all."""
WEBS, WORKERS = length((1, 1), (2, 3))
"""Processes of a house that is killed at random moments."""
SPREAD = 0.15
"""A kill comes up to so many seconds after work has gone on."""


def begin(db: Database) -> list[int]:
    return [start(db, ISLAND.new("human")).id for _ in range(RUNS)]


def hold_to_the_promises(house: House, runs: list[int]) -> None:
    assert house.audit() == []
    entries = []
    for run in runs:
        assert rebuild(house.store, run) == []
        in_x, heard = entries_of_x(house.store, run)
        assert in_x <= heard
        entries.append(in_x)
    assert sum(entries) > 0  # one run alone may have heard nothing but *neither*


def kill_at(house: House, name: str, points: list[Point], rng: random.Random, figures: Figures) -> None:
    """Kill a process at each of the points, in a random order; work goes on after each kill.

    One life shows that it goes on, and dies at the next point. Points at its start are tried in a row, and
    work goes on after the last of them.
    """
    house.commands[name].kill()
    for point in rng.sample(points, k=len(points)):
        passage = 1 if point.seldom else rng.randint(1, 3)
        house.begin(name, point._replace(passage=passage), later=not point.first)
        if not point.first:
            house.until_told(1)
            house.release(name)
        end = time.monotonic() + PATIENCE
        while house.commands[name].alive:
            in_time(end, lambda: f"never hit: {point.name}; {house.state()}")  # noqa: B023  # called at once
            house.keep(but=name)  # else it might be started again, without the point, before `alive` is asked
            time.sleep(0.01)
        figures.count("SIGKILLs at named points", f"{name}: {point.name}")
    house.begin(name)
    house.until_told(1)


@pytest.mark.parametrize("name", ["web", "worker 1"])
def test_killed_at_every_named_point(
    settings: Settings, store: str, db: Database, rng: random.Random, figures: Figures, name: str
) -> None:
    points, runs = WEB if name == "web" else WORKER, begin(db)
    if store == "postgresql":
        points = rng.sample(points, k=length(SAMPLED, len(points)))
    with House(settings, [*WEB, *WORKER]) as house:
        house.keep()
        house.move_in(runs, PARENTS, rng)
        house.until_told(2)
        for _ in range(length(1, 20)):
            kill_at(house, name, points, rng, figures)
        house.move_out()
        hold_to_the_promises(house, runs)


def test_killed_as_an_answer_is_committed(
    settings: Settings, db: Database, rng: random.Random, figures: Figures
) -> None:
    """The place at which a server that replies before it commits would be caught."""
    points, runs = [point for point in WEB if point.name == "at the commit of an answer"], begin(db)
    with House(settings, WEB) as house:
        house.keep()
        house.move_in(runs, PARENTS, rng)
        house.until_told(6)
        for _ in range(3):
            kill_at(house, "web", points, rng, figures)
        house.move_out()
        hold_to_the_promises(house, runs)


@pytest.mark.only("sqlite", "the store on which requests share a transaction")
def test_killed_within_a_group(
    settings: Settings, db: Database, rng: random.Random, figures: Figures
) -> None:
    """So many parents that their requests share transactions: none is told, or its answer is stored."""
    runs = begin(db)
    with House(settings, GROUP) as house:
        house.keep()
        house.move_in(runs, CROWD, rng)
        house.until_told(2)
        for _ in range(length(1, 20)):
            kill_at(house, "web", GROUP, rng, figures)
        house.move_out()
        hold_to_the_promises(house, runs)


def test_killed_at_random_moments(
    settings: Settings, store: str, db: Database, rng: random.Random, figures: Figures
) -> None:
    runs = begin(db)
    figures.count("houses", f"{WEBS} web, {WORKERS} workers")
    with House(settings, [*WEB, *WORKER], WORKERS, WEBS) as house:
        house.keep()
        house.move_in(runs, PARENTS, rng)
        house.until_told(2)
        for _ in range(KILLS[store]):
            time.sleep(rng.uniform(0, SPREAD))
            name = rng.choice(sorted(house.orders))
            figures.count("SIGKILLs at random moments", f"{name}: {house.kill(name)}")
            house.keep()
            house.until_told(1)
        house.move_out()
        places = len(figures.of("SIGKILLs at random moments"))
        assert places >= (3 if KILLS[store] > 10 else 2), "all kills fell into the same places"
        hold_to_the_promises(house, runs)


@pytest.mark.only("sqlite", "every point is tried, and PostgreSQL's share is sampled")
def test_killed_while_it_closes(
    settings: Settings, db: Database, rng: random.Random, figures: Figures
) -> None:
    """A worker that is stopped in order and killed before it is done leaves its runs to the next one."""
    runs = begin(db)
    with House(settings, [*WORKER, *CLOSING]) as house:
        house.keep()
        house.move_in(runs, PARENTS, rng)
        house.until_told(2)
        for point in CLOSING:
            house.commands["worker 1"].kill()
            house.begin("worker 1", point)
            house.until_told(2)
            house.commands["worker 1"].process.terminate()
            house.until_killed("worker 1", point.name)
            figures.count("SIGKILLs at named points", f"worker 1: {point.name}")
            house.begin("worker 1")
            house.until_told(1)
        house.move_out()
        hold_to_the_promises(house, runs)
