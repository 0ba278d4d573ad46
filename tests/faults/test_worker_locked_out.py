"""Another program holds the write lock: the worker waits, goes on by itself, and ends in time when told."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.runs import get_run
from parenting.server.settings import Settings
from parenting.server.store.sqlite import sqlite_module
from parenting.server.workers import alive
from tests.database import migrated
from tests.server.processes import Command, command


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    """SQLite's file is what another program locks."""
    return Settings(data=tmp_path, database_url=None)


@pytest.fixture
def db(settings: Settings) -> Iterator[Database]:
    database = migrated(settings)
    start(database, NewRun(world="unsafe-exploration", parent="scripted", pace=20))
    yield database
    database.close()


@contextmanager
def locked(data: Path) -> Iterator[None]:
    """A foreign program writes."""
    foreign = sqlite_module().connect(data / "parenting.db", isolation_level=None, timeout=30)
    foreign.execute("BEGIN IMMEDIATE")
    try:
        yield
    finally:
        foreign.rollback()
        foreign.close()


def until(met: Callable[[], bool], worker: Command) -> None:
    end = time.monotonic() + 60
    while not met():
        assert worker.alive, worker.said()
        assert time.monotonic() < end, worker.said()
        time.sleep(0.05)


@pytest.mark.slow
def test_a_lock_of_another_program_neither_ends_the_worker_nor_fails_the_run(
    settings: Settings, db: Database
) -> None:
    """It takes eight seconds, since the store is waited for five seconds before it counts as busy."""
    with command("worker", settings=settings) as worker:
        until(lambda: get_run(db, 1).tick > 5, worker)
        with locked(settings.data):
            until(lambda: "store refuses" in worker.said(), worker)
        until(lambda: "store is back after" in worker.said(), worker)
        before = get_run(db, 1).tick
        until(lambda: get_run(db, 1).tick > before, worker)
        assert get_run(db, 1).status == "active"
        with locked(settings.data):
            time.sleep(0.3)  # it is inside a write that waits
            began = time.monotonic()
            assert worker.stop() == 0
            took = time.monotonic() - began
        assert took < 5, "C7"
        assert "Traceback" not in worker.said()
    with command("worker", settings=settings) as again:
        until(lambda: get_run(db, 1).tick > before + 5, again)
        assert get_run(db, 1).status == "active"


def test_a_worker_that_starts_while_the_store_refuses_waits_for_it(settings: Settings, db: Database) -> None:
    with locked(settings.data), command("worker", settings=settings) as worker:
        until(lambda: "store refuses" in worker.said(), worker)
        assert alive(db) == []
        began = time.monotonic()
        assert worker.stop() == 0
        took = time.monotonic() - began
    assert took < 5, "C7"
