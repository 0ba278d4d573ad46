"""Damaged clips are written again when the tick that asked them is replayed, where that is proved."""

from __future__ import annotations

import json
from typing import Any

import pytest
from sqlalchemy import select, text

from parenting.server import machine, snapshot
from parenting.server.chain import check
from parenting.server.db import Database
from parenting.server.errors import DamagedRowError
from parenting.server.new_run import start
from parenting.server.snapshot import DivergedError, versions
from parenting.server.tables import Query
from tests.server.another_machine import RUN, live_to, taken_up
from tests.server.raising import ISLAND, inline, same_bits

CHECKPOINT, KILLED, END = 20, 40, 60
EMPTY: dict[str, Any] = {}


@pytest.fixture(autouse=True)
def no_checkpoint_by_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("parenting.server.checkpoint_pace.CHECKPOINT_SECONDS", 1e9)


def killed_after_its_checkpoint(db: Database) -> None:
    start(db, ISLAND.new("scripted"))
    life = taken_up(db)
    live_to(life, CHECKPOINT)
    life.save()
    live_to(life, KILLED)


def killed_as_it_waits(db: Database) -> int:
    """A run whose parent has not answered yet; the tick of its question."""
    start(db, ISLAND.new("human"))
    life = taken_up(db)
    while not record(db):
        live_to(life, life.last_tick + 1)
    return life.last_tick


def record(db: Database, after: int = 0) -> dict[int, Any]:
    """The clips of the questions asked after a tick."""
    with db.read() as session:
        rows = session.scalars(select(Query).where(Query.tick > after)).all()
        return {row.tick: row.clips for row in rows}


def put(db: Database, tick: int, clips: dict[str, Any]) -> None:
    with db.write() as session:
        put_there = text("UPDATE query SET clips = :clips WHERE tick = :tick")
        session.execute(put_there, {"clips": json.dumps(clips), "tick": tick})


@pytest.mark.slow
@pytest.mark.parametrize("damage", ["unreadable", "changed"])
def test_answered_questions_come_back_and_the_run_goes_on_with_the_same_bits(
    db: Database, damage: str
) -> None:
    killed_after_its_checkpoint(db)
    before = record(db, CHECKPOINT)
    assert len(before) > 5
    for tick, clips in before.items():
        exchanged = {"left": clips["right"], "right": clips["left"]}
        put(db, tick, EMPTY if damage == "unreadable" else exchanged)
    assert len(check(db, RUN).problems) > 5
    again = taken_up(db)
    live_to(again, END)
    assert {tick: record(db)[tick] for tick in before} == before
    assert same_bits(again.saved, inline(END)) == []
    assert check(db, RUN).problems == []


def test_what_no_answers_digest_proves_stays_as_it_is(db: Database) -> None:
    """As where a person's data was erased, and the salt with it."""
    killed_after_its_checkpoint(db)
    tick = min(record(db, CHECKPOINT))
    with db.write() as session:
        session.execute(text("UPDATE answer SET salt = NULL"))
    put(db, tick, EMPTY)
    with pytest.raises(DamagedRowError, match=f"The question of tick {tick} is damaged"):
        live_to(taken_up(db), END)
    assert record(db)[tick] == EMPTY


def test_a_question_that_nobody_has_answered_is_asked_as_it_was(db: Database) -> None:
    tick = killed_as_it_waits(db)
    before = record(db)
    put(db, tick, EMPTY)
    live_to(taken_up(db), tick)
    assert record(db) == before


def test_without_an_answer_another_machine_does_not_write_what_it_asks(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    tick = killed_as_it_waits(db)
    put(db, tick, EMPTY)
    here = {**versions(), "cpu": "another"}
    for module in (snapshot, machine):
        monkeypatch.setattr(module, "versions", lambda: here)
    with pytest.raises(DamagedRowError):
        live_to(taken_up(db), tick)
    assert record(db)[tick] == EMPTY


def test_without_an_answer_another_question_is_told_and_not_written_over(db: Database) -> None:
    tick = killed_as_it_waits(db)
    clips = record(db)[tick]
    exchanged = {"left": clips["right"], "right": clips["left"]}
    put(db, tick, exchanged)
    with pytest.raises(DivergedError):
        live_to(taken_up(db), tick)
    assert record(db)[tick] == exchanged
