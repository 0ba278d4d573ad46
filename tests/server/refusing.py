"""A store that refuses at its n-th statement or commit, and a worker that raises a short run on it."""

from __future__ import annotations

from typing import Any

import pytest
from sqlalchemy import select

from parenting.server.db import Database
from parenting.server.new_run import start
from parenting.server.runs import get_run, set_status
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from parenting.server.store.sqlite import sqlite_module
from parenting.server.tables import Answer, Query
from parenting.server.work import patience
from parenting.server.worker import Worker
from tests.faults import tap
from tests.faults.tap import COMMIT, Moment
from tests.server.conftest import Clock
from tests.server.raising import Begun, inline, last, same_bits

SAID = {
    "SQLITE_BUSY": "database is locked",
    "SQLITE_FULL": "database or disk is full",
    "SQLITE_IOERR_WRITE": "disk I/O error",
    "SQLITE_READONLY": "attempt to write a readonly database",
    "SQLITE_CANTOPEN": "unable to open database file",
}
CHANGES = {"stages": 2, "mature_every": 4, "time_limit": 8, "max_open_preferences": 0}
BEGUN = Begun("unsafe-exploration", "island", CHANGES, "lax")
GOAL = 6
"""Answers of the short run: guidance and preferences, two stages, a few episodes."""

Record = list[Any]


class Refusal:
    """Refuses from the n-th moment on, as often as it is told to: before an act, or after a commit."""

    def __init__(self, number: int, name: str = "SQLITE_BUSY", times: int = 1, when: str = "before") -> None:
        self.number, self.name, self.when = number, name, when
        self.passed, self.times, self.raised = 0, times, 0

    def __call__(self, moment: Moment) -> None:
        if moment.when != self.when or (self.when == "after" and moment.act != COMMIT):
            return
        self.passed += 1
        if self.passed >= self.number and self.raised < self.times:
            self.raised += 1
            error = sqlite_module().OperationalError(SAID[self.name])
            error.sqlite_errorname = self.name
            raise error


class Brisk(Worker):
    """A worker that ends by itself when the run rests at its goal, and hardly waits for the store."""

    def __init__(
        self, db: Database, clock: Clock, settings: Settings, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        super().__init__(db, settings)
        self.clock = clock
        monkeypatch.setattr(patience, "FIRST_WAIT", 0.0005)
        monkeypatch.setattr(patience, "LONGEST_WAIT", 0.001)
        monkeypatch.setattr(self.notifier, "wait", self._look_up)

    def _look_up(self, _seconds: float) -> bool:
        if not self.claims:  # it made one, and was told that it did not: it has to lapse
            self.clock.pass_seconds(10)
            self._claimed_at = -1.0
        rests = [seen.answered >= GOAL and not seen.answers for seen in self.schedule.seen.values()]
        if rests and all(rests) and not self.patience.waits:
            self.stop()
        return False


def raised_on(
    db: Database, clock: Clock, settings: Settings, monkeypatch: pytest.MonkeyPatch, refusal: Refusal
) -> tuple[int, Record]:
    """Raise the short run under a refusal, and once more without; return its id and its record."""
    run = start(db, BEGUN.new("scripted", GOAL)).id
    with tap.listening(refusal):
        Brisk(db, clock, settings, monkeypatch).work()
    clock.pass_seconds(10)  # if the end was refused, the claim has to lapse
    Brisk(db, clock, settings, monkeypatch).work()
    return run, record(db, run)


def record(db: Database, run: int) -> Record:
    """Everything that was asked, answered and heard, in its order."""
    with db.read() as session:
        asked = session.scalars(select(Query).where(Query.run_id == run).order_by(Query.tick)).all()
        heard = session.scalars(select(Answer).where(Answer.run_id == run).order_by(Answer.id)).all()
        questions = [(query.tick, query.kind, query.maturity, query.clips, query.status) for query in asked]
        return [questions, [(answer.choice, answer.standing, answer.applied_tick) for answer in heard]]


def hold(db: Database, run: int, found: Record, undisturbed: Record) -> None:
    """Hold a run against the undisturbed one: the same record, the same bits, nothing failed; end it."""
    kept = get_run(db, run)
    assert (kept.status, kept.reason, kept.answers) == ("active", None, GOAL)
    assert found == undisturbed
    saved = last(db, run, BEGUN)
    differ = same_bits(saved, inline(int(saved.state.keys.tick), BEGUN))
    assert not differ, differ
    set_status(db, run, RunStatus.STOPPED)  # no later worker takes it up
