"""`parenting copy` is killed at any statement: the source is as it was, and the next copy ends well.

It finishes, or it finds the copy complete already. `verify` and `replay` then find the copy equal.
"""

from __future__ import annotations

import random
import signal
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select

from parenting.server.db import Database, connect
from parenting.server.new_run import start
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim, get_run
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.tables import Table
from parenting.server.transfer.copying import copy
from tests.database import unmigrated
from tests.faults import tap
from tests.faults.clients import Nth
from tests.faults.figures import Figures
from tests.faults.tap import Moment
from tests.lengths import length
from tests.postgres import cluster
from tests.server.processes import Command
from tests.server.raising import ISLAND

pytestmark = [pytest.mark.torture, pytest.mark.timeout(length(1800, 6000))]
KILLS = length(2, 100)
TICKS = 15
SECONDS = 120.0


@pytest.fixture
def source(settings: Settings, db: Database) -> str:
    """A database that nobody uses, with a run that was raised for a while."""
    run = start(db, ISLAND.new("scripted")).id
    (mine,) = claim(db, "test")
    life = RunSession(db, mine, get_run(db, run), lambda: None)
    while life.last_tick < TICKS:
        life.tick(watch(db, [run])[run])
    life.save()
    db.close()
    return settings.database_url or str(settings.data / "parenting.db")


@pytest.fixture
def emptied(settings: Settings, store: str) -> Iterator[Callable[[], str]]:
    """Make a target of the other store, each time without what the one before held."""
    if store == "postgresql":
        file = settings.data / "target" / "parenting.db"

        def no_file() -> str:
            file.unlink(missing_ok=True)
            return str(file)

        yield no_file
        return
    name = cluster().new_name()
    url = cluster().url(name)

    def no_tables() -> str:
        cluster().drop(name)
        unmigrated(Settings(data=settings.data, database_url=url)).close()
        return url

    yield no_tables
    cluster().drop(name)


def contents(place: str) -> dict[str, list[Any]]:
    """All rows; SQLite keeps deleted numbers in the identity."""
    url = place if "://" in place else f"sqlite:///{place}"
    db = connect(Settings(data=Path("/nowhere"), database_url=url), reading=True)
    with db.read() as session:
        found = {
            one.name: sorted(
                repr(tuple(row)[:4] if one.name == "database_identity" else tuple(row)) for row in rows
            )
            for one in Table.metadata.sorted_tables
            for rows in [session.execute(select(one)).all()]
        }
    db.close()
    return found


def moments(place: str, target: str, data: Path) -> int:
    """The number of statements and commits of a whole copy, before and after each."""
    seen: list[Moment] = []
    with tap.listening(seen.append):
        copy(place, target, data)
    return len(seen)


def doomed(number: int) -> None:
    tap.listen(Nth(number))


def until_left_alone() -> None:
    """Wait until PostgreSQL has noticed that the process which was killed is gone."""
    others = (
        "SELECT 1 FROM pg_stat_activity WHERE backend_type = 'client backend' AND pid != pg_backend_pid()"
    )
    end = time.monotonic() + SECONDS
    while cluster().admin.execute(others).fetchone():
        assert time.monotonic() < end, "the connection of a killed process stays"
        time.sleep(0.01)


def test_a_copy_that_is_killed_is_made_again(
    settings: Settings,
    store: str,
    source: str,
    emptied: Callable[[], str],
    rng: random.Random,
    figures: Figures,
) -> None:
    before, data = contents(source), settings.data
    last = moments(source, emptied(), data)
    target = emptied()
    for number in sorted(rng.sample(range(1, last + 1), KILLS)):
        killed = Command("copy", source, target, data=data, prepare=partial(doomed, number))
        killed.process.join(SECONDS)
        assert killed.process.exitcode == -signal.SIGKILL, (number, last, killed.said())
        figures.count("SIGKILLs of parenting copy", f"from {store}")
        until_left_alone()
        assert contents(source) == before
        until_left_alone()
    again = Command("copy", source, target, data=data)
    code = again.wait(SECONDS)
    assert code == 0 or (code == 2 and "The target is not empty" in again.said()), again.said()
    until_left_alone()
    assert contents(target) == before == contents(source)
    url = target if "://" in target else f"sqlite:///{target}"
    for command in ("verify", "replay"):
        done = Command(command, "1", data=data, environment={"PARENTING_DATABASE_URL": url})
        assert done.wait(SECONDS) == 0, done.said()
