"""One run holds up no other, whatever it does; a run that waits costs nothing; signs of life go on."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from parenting.server.db import Database
from parenting.server.errors import BusyError, DamagedError
from parenting.server.new_run import NewRun, start
from parenting.server.runs import get_run
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.work.turns import HUNG_SECONDS
from parenting.server.worker import POLL_SECONDS, Worker
from parenting.server.workers import alive
from tests.server.conftest import Clock


@pytest.fixture
def worker(db: Database, settings: Settings) -> Worker:
    return Worker(db, settings, beside_after=0.02)


@pytest.fixture
def gate() -> Iterator[threading.Event]:
    gate = threading.Event()
    yield gate
    gate.set()


def begin(db: Database, number: int) -> list[int]:
    return [start(db, NewRun(world="unsafe-exploration", parent="human")).id for _ in range(number)]


def rounds(worker: Worker, met: Callable[[], bool]) -> None:
    """Do as the worker's loop does, until something holds."""
    end = time.monotonic() + 60
    while not met():
        assert time.monotonic() < end
        worker._go_on()
    worker.notifier.close()


def slow(monkeypatch: pytest.MonkeyPatch, name: str, run: int, gate: threading.Event) -> None:
    """Let one run wait for the gate in a method of its session."""
    quick = getattr(RunSession, name)

    def slowly(self: RunSession, *arguments: Any) -> Any:
        claim = arguments[1] if name == "__init__" else self.claim
        if claim.run_id == run:
            assert gate.wait(60)
        return quick(self, *arguments)

    monkeypatch.setattr(RunSession, name, slowly)


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("name", ["__init__", "tick", "report_waiting", "save"])
def test_a_run_that_takes_long_holds_up_no_other(
    db: Database, worker: Worker, monkeypatch: pytest.MonkeyPatch, gate: threading.Event, name: str
) -> None:
    """The others come to their questions, and signs of life go on."""
    monkeypatch.setattr("parenting.server.checkpoint_pace.CHECKPOINT_SECONDS", 0.0)
    monkeypatch.setattr("parenting.server.checkpoint_pace.QUIET_SECONDS", 0.0)
    monkeypatch.setattr("parenting.server.checkpoint_pace.QUIET_EACH", 0.0)
    held, *others = begin(db, 3)
    slow(monkeypatch, name, held, gate)
    rounds(worker, lambda: all(get_run(db, run).waiting == "guidance" for run in others))
    rounds(worker, lambda: worker.turns.working() == {held})  # the turn that asked may still save
    worker.signs.give()
    assert alive(db) == [worker.name]
    gate.set()
    rounds(worker, lambda: get_run(db, held).waiting == "guidance")


def test_a_round_that_takes_long_looks_again_after_two_turns(
    db: Database, settings: Settings, worker: Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker, "_round_seconds", 0.0)
    begin(db, 5)
    worker._claim()
    begun: list[int] = []
    monkeypatch.setattr(worker.turns, "begin", lambda run_id, turn, urgent: begun.append(run_id))
    assert worker._round(), "another round follows at once"
    assert len(begun) == 2
    monkeypatch.setattr(worker, "_round_seconds", 60.0)
    worker._round()
    assert len(begun) == 7


def test_a_hung_run_loses_its_claim_and_another_worker_takes_it(
    db: Database,
    settings: Settings,
    clock: Clock,
    worker: Worker,
    monkeypatch: pytest.MonkeyPatch,
    gate: threading.Event,
) -> None:
    """So do all runs of a process that is stopped as a whole, since it signs nothing."""
    hung, fine = begin(db, 2)
    slow(monkeypatch, "tick", hung, gate)
    rounds(worker, lambda: worker.turns.working() == {hung})
    monkeypatch.setattr(worker.turns, "working", lambda longer_than=0.0: {hung})
    assert HUNG_SECONDS > 60
    clock.pass_seconds(settings.claim_seconds + 1)
    worker.signs.give()
    other = Worker(db, settings)
    other.name = "elsewhere:1"
    other._claim()
    assert set(other.claims) == {hung}
    assert set(worker.claims) == {hung, fine}
    monkeypatch.undo()
    gate.set()
    rounds(worker, lambda: set(worker.claims) == {fine})  # its next write told it


@pytest.mark.slow
def test_a_run_that_waits_has_no_turn_without_news(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.server.checkpoint_pace.CHECKPOINT_SECONDS", 1e9)
    monkeypatch.setattr("parenting.server.why.WRITE_SECONDS", 1e9)
    worker = Worker(db, settings)
    ids = begin(db, 12)
    rounds(worker, lambda: all(get_run(db, run).waiting == "guidance" for run in ids))
    begun: list[int] = []
    worker._round()
    monkeypatch.setattr(worker.turns, "begin", lambda run_id, turn: begun.append(run_id))
    for _ in range(20):
        worker._round()
        worker.signs.give()
    assert begun == []


@pytest.mark.slow
def test_what_the_store_refuses_one_run_does_not_stop_the_others(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The checkpoint of one run is damaged, or does not fit on the disk."""
    refused, other = begin(db, 2)
    take_up = RunSession.__init__

    def taken(self: RunSession, db: Database, claim: Any, *more: Any) -> None:
        if claim.run_id == refused:
            raise DamagedError
        take_up(self, db, claim, *more)

    monkeypatch.setattr(RunSession, "__init__", taken)
    worker = Worker(db, settings)
    rounds(worker, lambda: get_run(db, other).waiting == "guidance")
    assert not worker.patience.waits
    assert get_run(db, refused).status == "active"
    monkeypatch.undo()
    rounds(worker, lambda: get_run(db, refused).waiting == "guidance")


def test_a_failure_that_cannot_be_noted_is_noted_later(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    (run,) = begin(db, 1)

    def fails(*_: Any) -> None:
        raise ArithmeticError("no such policy")

    def busy(*_: Any) -> None:
        raise BusyError

    monkeypatch.setattr(RunSession, "tick", fails)
    worker = Worker(db, settings)
    with monkeypatch.context() as locked:
        locked.setattr("parenting.server.work.held.runs.finish", busy)
        worker._claim()
        worker._round()
        assert get_run(db, run).status == "active"
    rounds(worker, lambda: get_run(db, run).status == "failed")
    assert get_run(db, run).reason == "The agent could not go on: no such policy"


def test_a_poll_leaves_a_tick_its_part_of_the_tenth_of_a_second_that_is_promised() -> None:
    """An answer whose notification was lost waits for one poll and a tick (C8)."""
    assert POLL_SECONDS <= 0.08
