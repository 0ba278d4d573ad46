"""SIGKILL inside a migration: afterwards the tables are the old ones or the new ones, whole, and all goes on.

The database is that of a living house: it is taken back to an older revision and up again, and each of these
migrations is killed at some point. Copies that have their name are whole.
"""

from __future__ import annotations

import importlib
import os
import random
import signal
from collections.abc import Sequence
from functools import partial
from typing import Any

import pytest

from parenting.server.backups import copies, dumps
from parenting.server.chain import check
from parenting.server.db import Database, connect
from parenting.server.migrate import known_revisions, newest, revision, upgrade
from parenting.server.new_run import start
from parenting.server.settings import Settings
from tests.faults import tap
from tests.faults.auditor import audit
from tests.faults.clients import Nth
from tests.faults.figures import Figures
from tests.faults.house import House
from tests.faults.ledger import read
from tests.faults.rebuilt import rebuild
from tests.lengths import length
from tests.server.processes import Command, store_of
from tests.server.raising import ISLAND

pytestmark = [pytest.mark.torture, pytest.mark.timeout(length(1800, 20000))]
OLD = "0003"
"""The revision to which the database is taken back; older ones know no fencing tokens."""
GROUP = "SIGKILLs inside a migration"
BACKUPS = "parenting.server.backups"
PLACES = {
    "before the copy": (f"{BACKUPS}.before_migrating.keep",),
    "after the copy is written, before it is synced": (f"{BACKUPS}.whole._sync",),
    "before the copy has its name": (f"{BACKUPS}.whole._name",),
    "after the copy, before the first change": ("alembic.command.upgrade", "alembic.command.downgrade"),
    "after the commit, before old copies are removed": (f"{BACKUPS}.before_migrating.prune",),
}
"""Functions at whose first call a migration dies."""
RANDOM = {"sqlite": length(8, 2000), "postgresql": length(4, 500)}
"""Kills at random statements, besides."""
MOMENTS = {"sqlite": 120, "postgresql": 80}
"""A migration passes more moments than these: before and after each statement and the commit."""
KEPT = "SELECT run_id, query_id, number, choice, client_id, applied_tick FROM answer ORDER BY run_id, number"
"""The columns of answers that every revision has."""


def dies(*_: Any, **__: Any) -> None:
    """Kill this process, in place of a function."""
    os.kill(os.getpid(), signal.SIGKILL)


def kill_in(*names: str) -> None:
    """In a process that was just started: let it die where one of these functions is called first."""
    for name in names:
        module, _, function = name.rpartition(".")
        setattr(importlib.import_module(module), function, dies)


def kill_at(number: int) -> None:
    """In a process that was just started: let it die at the n-th moment that the tap sees."""
    tap.listen(Nth(number))


def migrating(settings: Settings, prepare: Any, old: bool) -> Command:
    """`parenting migrate` as a process, up if the tables are old, else down."""
    order = ("migrate",) if old else ("migrate", "--to", OLD)
    return Command(*order, data=settings.data, prepare=prepare, environment=store_of(settings))


def found(settings: Settings) -> str:
    """The revision of a database that was left as it is; it can be opened."""
    db = connect(settings)
    try:
        return str(revision(db))
    finally:
        db.close()


def hold_the_copies(settings: Settings, known: Sequence[str]) -> None:
    """A copy that has its name is whole and of the revision in its name."""
    for file in (settings.data / "backups").glob("[!.]*"):
        named = file.name.removeprefix("before-migration-").partition("-")[0]
        assert named in known
        if file.suffix == ".db":
            assert copies.check(file).revision == named
        else:
            assert dumps.check(file) > 5


@pytest.mark.slow_on("postgresql")
def test_migration_killed_anywhere_leaves_the_old_or_the_new_tables(
    settings: Settings, store: str, db: Database, rng: random.Random, figures: Figures
) -> None:
    runs = [start(db, ISLAND.new("human")).id]
    db.close()
    with House(settings) as house:
        house.keep()
        house.move_in(
            runs, 2, rng, skips=0.0
        )  # no older table can hold a skip, so that such a house stays new
        house.until_told(8)
        house.move_out()
        assert house.audit() == []
        answers, known = house.store.rows(KEPT), known_revisions()
        points: list[tuple[str, Any]] = [(name, partial(kill_in, *where)) for name, where in PLACES.items()]
        points += [
            ("at a random statement", partial(kill_at, rng.randint(1, MOMENTS[store])))
            for _ in range(RANDOM[store])
        ]
        before = found(settings)
        for name, prepare in rng.sample(points, k=len(points)):
            one = migrating(settings, prepare, before != newest())
            code = one.wait(120)
            assert code in (0, -signal.SIGKILL), one.said()
            after = found(settings)
            assert after in ({before, OLD} if before == newest() else {before, newest()})
            assert house.store.rows(KEPT) == answers
            assert house.store.damage() == []
            hold_the_copies(settings, known)
            changed = "new" if after != before else "old"
            how = f"{name}: the {changed} tables" if code else "none: it was done before"
            figures.count(GROUP, how)
            if after == before and code:
                again = migrating(settings, None, before != newest())
                assert again.wait(120) == 0, again.said()
                after = found(settings)
                assert after != before
            before = after
        goes_on(house, runs, rng)


def goes_on(house: House, runs: list[int], rng: random.Random) -> None:
    """Bring the tables up to date; the same house answers on, and all that it was ever told is there."""
    db = connect(house.settings)
    upgrade(db)
    house.parents.clear()
    house.commands.clear()
    house.keep()
    house.move_in(runs, 2, rng)
    house.until_told(4)
    house.move_out()
    assert audit(house.store, read(house.ledger.file)) == []
    for run in runs:
        assert rebuild(house.store, run) == []
        assert check(db, run).problems == []
    db.close()
