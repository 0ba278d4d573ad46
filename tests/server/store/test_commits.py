"""Polls look where somebody has committed; a worker's own sign of life is passed over."""

import threading
from collections.abc import Iterator
from contextlib import closing

import pytest
from sqlalchemy import text

from parenting.server import workers
from parenting.server.db import Database, connect
from parenting.server.new_run import NewRun, start
from parenting.server.settings import Settings
from tests.database import migrated
from tests.server.conftest import Clock


class Looks:
    """A poll that counts how often it looks."""

    def __init__(self, db: Database) -> None:
        self.db, self.number = db, 0

    def _look(self) -> int:
        self.number += 1
        return self.number

    def __call__(self) -> int:
        return self.db.cached("looks", self._look)


@pytest.fixture
def other(db: Database, settings: Settings) -> Iterator[Database]:
    """Another process."""
    with closing(connect(settings)) as other:
        yield other


def sign(db: Database, clock: Clock) -> None:
    clock.pass_seconds(1)
    workers.sign(db, "this one")


def test_a_worker_passes_over_its_own_sign(db: Database, other: Database, clock: Clock) -> None:
    looks, elsewhere = Looks(db), Looks(other)
    sign(db, clock)
    before = looks(), elsewhere()
    for _ in range(3):
        sign(db, clock)
        assert looks() == before[0]
    assert elsewhere() > before[1], "it is news to others"
    assert workers.alive(db) == ["this one"]


def test_commits_of_others_are_seen_whenever_they_come(db: Database, other: Database, clock: Clock) -> None:
    """Before a sign, within one, and after it; by this process too."""
    looks = Looks(db)
    start(db, NewRun(world="unsafe-exploration"))
    seen = looks()
    workers.sign(other, "another")
    sign(db, clock)
    again = looks()
    assert again > seen
    sign(db, clock)
    workers.sign(other, "another")
    seen = looks()
    assert seen > again
    if not db.one_writer:
        with db.write_unseen() as session:
            session.execute(text("UPDATE run SET name = 'a'"))
            workers.sign(other, "another")
        again = looks()
        assert again > seen
        seen = again
    with db.write() as session:
        session.execute(text("UPDATE run SET name = 'b'"))
    sign(db, clock)
    assert looks() > seen


def fail(db: Database) -> None:
    with db.write_unseen() as session:
        session.execute(text("UPDATE run SET name = 'after'"))
        raise ZeroDivisionError


def test_a_transaction_that_fails_leaves_nothing_and_the_next_poll_looks(db: Database, clock: Clock) -> None:
    start(db, NewRun(world="unsafe-exploration", name="before"))
    looks = Looks(db)
    before = looks()
    with pytest.raises(ZeroDivisionError):
        fail(db)
    if db.one_writer:
        assert looks() > before, "it has another connection, which counts for itself"
    with db.read() as session:
        assert session.scalar(text("SELECT name FROM run")) == "before"
    sign(db, clock)
    seen = looks()
    sign(db, clock)
    assert looks() == seen


def test_an_end_does_not_wait_for_a_transaction_that_the_store_holds(settings: Settings) -> None:
    migrated(settings).close()
    db, begun, gate = connect(settings), threading.Event(), threading.Event()

    def hang() -> None:
        with db.write_unseen():
            begun.set()
            assert gate.wait(60)

    thread = threading.Thread(target=hang)
    thread.start()
    assert begun.wait(60)
    closed = threading.Thread(target=db.close)
    closed.start()
    closed.join(30)
    assert not closed.is_alive(), "it would wait for the gate"
    gate.set()
    thread.join(60)
