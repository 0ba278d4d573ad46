"""Waits for the store draw on one deadline."""

import threading

import pytest

from parenting.server.db import Database, connect
from parenting.server.errors import BusyError
from parenting.server.settings import Settings
from parenting.server.store.patience import patience, remaining

pytestmark = pytest.mark.only("sqlite", "the lock of the one file")


def test_without_a_deadline_the_whole_time_remains() -> None:
    assert remaining(5.0) == 5.0


def test_inner_patience_never_extends_the_outer() -> None:
    with patience(0.0), patience(10.0):
        assert remaining(5.0) == 0.0
    assert remaining(5.0) == 5.0


def test_write_waits_no_longer_than_its_caller_may(settings: Settings, db: Database) -> None:
    """With the usual five seconds it would get the lock, which is free after one."""
    other = connect(settings)
    held, release = threading.Event(), threading.Event()

    def hold() -> None:
        with other.write():
            held.set()
            release.wait(10)

    holder = threading.Thread(target=hold)
    holder.start()
    held.wait()
    threading.Timer(1.0, release.set).start()
    with patience(0.1), pytest.raises(BusyError), db.write():
        pass
    assert not release.is_set()
    with db.write():  # the usual patience is back on the same connection
        pass
    holder.join()
    other.close()


def test_willing_store_refuses_nothing(db: Database) -> None:
    assert db.refusal() is None


def test_locked_store_says_busy(settings: Settings, db: Database) -> None:
    other = connect(settings)
    with other.write(), patience(0.1):
        assert isinstance(db.refusal(), BusyError)
    assert db.refusal() is None
    other.close()
