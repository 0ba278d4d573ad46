"""A worker deletes a person's data beside its runs, not between their turns."""

from __future__ import annotations

import threading
import time

import pytest
import torch

from parenting.server import erasing, erasure
from parenting.server.db import Database
from parenting.server.errors import LostClaimError, ServerError
from parenting.server.persons import pseudonyms
from parenting.server.queue.answers import answer
from parenting.server.runs import Claim, claim, get_run
from parenting.server.settings import Settings
from parenting.server.tables import Run
from parenting.server.work.chores import Chores
from parenting.server.worker import Worker
from tests.server.conftest import Clock

pytestmark = pytest.mark.only("sqlite", "threads of one worker")


@pytest.fixture
def ann(db: Database, mine: Claim, guidance: int) -> int:
    """A person whose data are to be deleted."""
    answer(db, guidance, "left", "ann", "human")
    erasure.begin(db, pseudonyms(db, ["ann"])["ann"])
    return erasure.under_way(db)[0].id


def until_over(chores: Chores) -> None:
    thread = chores.erasures._thread
    assert thread is not None
    thread.join(30)
    assert not thread.is_alive()


def test_a_worker_goes_on_while_it_deletes(db: Database, ann: int, monkeypatch: pytest.MonkeyPatch) -> None:
    go_on, begun, asked = threading.Event(), threading.Event(), list[int]()

    def slowly(_db: Database, person_id: int) -> bool:
        asked.append(person_id)
        begun.set()
        return go_on.wait(30)

    monkeypatch.setattr(erasing, "go_on", slowly)
    chores = Chores(db, 0.0)
    for _ in range(3):
        chores._due = 0.0
        chores.go_on()  # returns, although the deletion goes on
        assert begun.wait(30)
    assert asked == [ann], "one at a time"
    go_on.set()
    until_over(chores)


def test_a_process_that_ends_meanwhile_does_not_wait_for_it(
    db: Database, settings: Settings, ann: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor does it close the store below it, or end Python while torch computes."""
    go_on = threading.Event()
    monkeypatch.setattr(erasing, "go_on", lambda _db, _person: go_on.wait(30))
    worker = Worker(db, settings)
    assert not worker.working()
    worker.chores.go_on()
    assert worker.working()
    go_on.set()
    until_over(worker.chores)
    assert not worker.working()


def test_run_is_held_however_long_it_takes(
    db: Database, clock: Clock, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(erasing, "SIGN_SECONDS", 0.01)
    ours = erasing._take_over(db, mine.run_id)

    def signed() -> bool:
        return get_run(db, mine.run_id).claim_mark == clock.now.timestamp()

    with erasing._held(db, ours):
        for _ in range(3):
            clock.pass_seconds(4)
            end = time.monotonic() + 30
            while not signed():
                assert time.monotonic() < end
                time.sleep(0.01)
        assert claim(db, "another", 5) == []
    assert [one.run_id for one in claim(db, "another", 5)] == [mine.run_id]


def test_who_lost_the_run_signs_no_more(db: Database, mine: Claim, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(erasing, "SIGN_SECONDS", 0.01)
    ours = erasing._take_over(db, mine.run_id)
    with db.write() as session:
        session.get_one(Run, mine.run_id).fencing_token += 1
    erasing._sign(db, ours, threading.Event())  # returns
    assert get_run(db, mine.run_id).worker == erasing.NAME


@pytest.mark.parametrize("error", [LostClaimError("taken up"), ServerError("busy"), ZeroDivisionError()])
def test_what_fails_is_tried_again_later(
    db: Database, ann: int, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def fails(_db: Database, _person: int) -> bool:
        raise error

    chores = Chores(db, 0.0)
    with monkeypatch.context() as patched:
        patched.setattr(erasing, "go_on", fails)
        chores.go_on()
        until_over(chores)
    assert not chores.erasures.may_begin()
    assert len(erasure.under_way(db)) == 1
    monkeypatch.setattr(chores.erasures, "_again", 0.0)
    chores._due = 0.0
    chores.go_on()
    until_over(chores)
    assert erasure.under_way(db) == []


def test_it_takes_one_thread_of_torch(db: Database, ann: int, monkeypatch: pytest.MonkeyPatch) -> None:
    found = list[int]()
    monkeypatch.setattr(torch, "set_num_threads", found.append)
    chores = Chores(db, 0.0)
    chores.go_on()
    until_over(chores)
    assert found == [1]
