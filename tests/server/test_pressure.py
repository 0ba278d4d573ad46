"""Work for which nobody waits is left for later while people wait for other runs, and is never lost."""

from __future__ import annotations

import time
from typing import Any

import pytest
from sqlalchemy import func, select

from parenting.server.board.writer import SHARE, SHARE_OF_ALL
from parenting.server.board_tables import BoardSnapshot
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.operator_events import add_operator_event
from parenting.server.pressure import PRESSED_SECONDS, PUT_OFF_SECONDS, Pressure, PutOff
from parenting.server.queue import answers
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim, get_run, set_status
from parenting.server.session import RunSession
from parenting.server.statuses import RunStatus, Waiting
from parenting.server.tables import Checkpoint, Metric, Query, Reason
from parenting.server.work.held import HeldRuns
from parenting.server.work.patience import Patience
from parenting.server.work.schedule import AT_LEISURE, NOW


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    clock = [100.0]
    monkeypatch.setattr("parenting.server.pressure.time.monotonic", lambda: clock[0])
    return clock


def test_it_is_put_off_for_a_bounded_time(now: list[float]) -> None:
    pressure = Pressure()
    rest = PutOff(pressure)
    assert not rest.may_wait(), "nobody waits for another run"
    pressure.waiting = True
    for _ in range(3):
        now[0] += PUT_OFF_SECONDS / 4
        assert rest.may_wait()
    now[0] += PUT_OFF_SECONDS / 4
    assert not rest.may_wait(), "it was put off for long enough"
    assert rest.may_wait(), "and has just been done"
    pressure.waiting = False
    assert not rest.may_wait()


def test_pressure_lasts_for_a_second_after_people_waited(now: list[float]) -> None:
    pressure = Pressure()
    pressure.press(people_wait=False, runs=3)
    assert (pressure.waiting, pressure.runs) == (False, 3)
    pressure.press(people_wait=True, runs=3)
    now[0] += PRESSED_SECONDS / 2
    pressure.press(people_wait=False, runs=3)
    assert pressure.waiting, "in a crowd the next one comes at once"
    now[0] += PRESSED_SECONDS / 2
    pressure.press(people_wait=False, runs=3)
    assert not pressure.waiting


def begin(db: Database, pressure: Pressure, finish: str | None = None) -> RunSession:
    config: dict[str, Any] = {"p_guid": 0.9}
    run = start(db, NewRun(world="unsafe-exploration", parent="human", seed=3, config=config, finish=finish))
    (mine,) = claim(db, "test")
    return RunSession(db, mine, run, lambda: None, pressure)


def ask(life: RunSession) -> int:
    """Live until the agent waits for guidance, and return the question's number."""
    run_id = life.claim.run_id
    while not (seen := watch(life.db, [run_id])[run_id]).open_guidance:
        life.tick(seen)
    return last_question(life.db)


def last_question(db: Database) -> int:
    with db.read() as session:
        return session.execute(select(func.max(Query.id))).scalar_one()


def rows(db: Database) -> dict[str, int]:
    with db.read() as session:
        tables = (Query, Metric, Reason, BoardSnapshot, Checkpoint)
        found = {one.__tablename__: session.scalar(select(func.count()).select_from(one)) for one in tables}
    return {name: number or 0 for name, number in found.items()}


def test_a_question_waits_for_nothing_else_and_the_rest_comes_with_the_next_turn(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.server.why.WRITE_SECONDS", 0.0)
    monkeypatch.setattr("parenting.server.pressure.PUT_OFF_SECONDS", 1e9)
    pressure = Pressure(waiting=True)
    life, run_id = begin(db, pressure), 1
    before = rows(db)
    for _ in range(3):
        answers.answer(db, ask(life), "either", "somebody", "human")
        life.tick(watch(db, [run_id])[run_id])
    ask(life)
    asked = rows(db)
    assert asked["query"] >= 4
    assert asked == before | {"query": asked["query"]}, "nothing but questions"
    pressure.waiting = False
    life.report_waiting(watch(db, [run_id])[run_id])
    found = rows(db)
    assert found["reason"] == found["query"], "the reasons of all of them"
    assert (found["metric"], found["board_snapshot"]) == (1, 1)
    with db.read() as session:
        (row,) = session.scalars(select(Metric))
    assert (row.tick, row.values["either"]) == (life.last_tick, 3)
    life.save()
    assert rows(db)["checkpoint"] == before["checkpoint"] + 1


@pytest.fixture
def held(db: Database, monkeypatch: pytest.MonkeyPatch) -> HeldRuns:
    """A worker's run 1, which has heard an answer and asked again while people wait for other runs."""
    monkeypatch.setattr("parenting.server.pressure.PUT_OFF_SECONDS", 1e9)
    found = HeldRuns(db, Patience(), lambda run: None)
    life = begin(db, found.pressure)
    found.claims[1], found.sessions[1] = life.claim, life
    found.pressed(people_wait=True)
    answers.answer(db, ask(life), "either", "somebody", "human")
    ask(life)
    assert rows(db)["metric"] == 0
    return found


def turn(held: HeldRuns, db: Database) -> None:
    held.turn(1, watch(db, [1])[1])


@pytest.mark.parametrize(("behind", "due"), [(-1, AT_LEISURE), (0, NOW), (9, NOW)])
def test_a_turn_with_rows_to_write_is_at_leisure_unless_it_replays(
    held: HeldRuns, db: Database, monkeypatch: pytest.MonkeyPatch, behind: int, due: float
) -> None:
    """A tick that is lived again changes nothing that tells the worker of the next one."""
    life = held.sessions[1]
    monkeypatch.setattr(life, "tick", lambda seen: False)
    monkeypatch.setattr(life, "ready", lambda seen: True)
    monkeypatch.setattr(life, "record_ends", life.last_tick + behind)
    assert life.unmeasured
    assert held.turn(1, watch(db, [1])[1]) == due


def stored(db: Database) -> tuple[int, int, Waiting | None]:
    """The rows of metrics, and the tick and the wait that the run reports."""
    run = get_run(db, 1)
    return rows(db)["metric"], run.tick or 0, run.waiting


def test_a_worker_that_ends_does_what_it_has_put_off(held: HeldRuns, db: Database) -> None:
    before = rows(db)
    held.save((), time.monotonic() + 60)
    found = rows(db)
    assert stored(db) == (1, held.sessions[1].last_tick, Waiting.GUIDANCE)
    assert found["reason"] == found["query"] == 2
    assert found["checkpoint"] == before["checkpoint"] + 1


def test_a_paused_run_has_its_row(held: HeldRuns, db: Database) -> None:
    set_status(db, 1, RunStatus.PAUSED)
    turn(held, db)
    assert stored(db) == (1, held.sessions[1].last_tick, Waiting.GUIDANCE)


def test_a_stopped_run_has_its_row_and_waits_for_nobody(held: HeldRuns, db: Database) -> None:
    tick = held.sessions[1].last_tick
    set_status(db, 1, RunStatus.STOPPED)
    turn(held, db)
    assert not held.sessions
    assert stored(db) == (1, tick, None)


def test_a_life_leaves_memory_after_its_row(held: HeldRuns, db: Database) -> None:
    assert not held.lives.guided(), "it has not reported that it waits"
    turn(held, db)
    assert held.lives.guided() == {1}
    assert stored(db) == (1, held.sessions[1].last_tick, Waiting.GUIDANCE)
    answers.answer(db, last_question(db), "either", "somebody", "human")
    ask(held.sessions[1])
    tick = held.sessions[1].last_tick
    assert not held.lives.guided()
    held.rest(1)
    assert not held.sessions
    assert stored(db) == (2, tick, Waiting.GUIDANCE)


def test_a_run_that_ends_when_its_policy_is_optimal_is_measured_at_once(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.server.pressure.PUT_OFF_SECONDS", 1e9)
    life = begin(db, Pressure(waiting=True), finish="optimal")
    answers.answer(db, ask(life), "either", "somebody", "human")
    ask(life)
    found = rows(db)
    assert found["metric"] == 2, "one for the tick of each question"
    assert (found["reason"], found["board_snapshot"]) == (0, 0)


def test_a_tick_without_an_answer_has_its_row(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("parenting.server.pressure.PUT_OFF_SECONDS", 1e9)
    pressure = Pressure()
    life = begin(db, pressure)
    ask(life)
    life.report_waiting(watch(db, [1])[1])
    known, pressure.waiting = rows(db)["metric"], True
    add_operator_event(db, 1, "end_episode", {})
    life.tick(watch(db, [1])[1])
    assert rows(db)["metric"] == known
    life.report_waiting(watch(db, [1])[1])
    assert stored(db)[:2] == (known + 1, life.last_tick)


class Clock:
    """A clock that goes on by a millisecond whenever somebody looks at it."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        self.now += 0.001
        return self.now


@pytest.mark.slow
def test_snapshots_of_all_runs_of_a_worker_take_a_bounded_share_of_its_time(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.server.board.writer.time.monotonic", clock := Clock())
    pressure = Pressure()
    life = begin(db, pressure)
    waits = dict[int, float]()
    for runs in (1, 5, 50):
        pressure.runs, pressure.waiting = runs, False
        clock.now += 1000
        answers.answer(db, ask(life), "either", "somebody", "human")
        life.tick(watch(db, [1])[1])  # a snapshot
        pressure.waiting = True
        answers.answer(db, ask(life), "either", "somebody", "human")
        life.tick(watch(db, [1])[1])  # none
        known, began = rows(db)["board_snapshot"], clock.now
        while rows(db)["board_snapshot"] == known:
            clock.now += 0.01
            life.board.go_on(life.saved)
        waits[runs] = clock.now - began
    assert waits[5] == pytest.approx(waits[1], rel=0.2)
    assert waits[50] == pytest.approx(waits[1] * SHARE / (SHARE_OF_ALL / 50), rel=0.2)
