"""Signs of life of workers; a goal, and a pace."""

from __future__ import annotations

import socket

import pytest

from parenting.server.checkpoints import load_checkpoints
from parenting.server.db import Database
from parenting.server.errors import Conflict
from parenting.server.new_run import NewRun, start
from parenting.server.operator_events import add_operator_event
from parenting.server.progress import report_progress
from parenting.server.queue import worker_side
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease, lease_ahead, may_lease
from parenting.server.runs import Claim, claim, get_run, set_goal, set_pace, set_status
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from parenting.server.tables import Run
from parenting.server.worker import Worker
from parenting.server.workers import SILENT_SECONDS, alive, is_here, new_name, sign, sign_off
from tests.server.conftest import CLIPS, Clock
from tests.server.heard import heard_answers


def test_signs_of_life(db: Database, clock: Clock) -> None:
    sign(db, "b")
    sign(db, "a")
    assert alive(db) == ["a", "b"]
    clock.pass_seconds(SILENT_SECONDS + 1)
    sign(db, "a")
    assert alive(db) == ["a"]
    sign_off(db, "a")
    assert alive(db) == []


def test_two_workers_of_one_host_name_and_process_id_have_two_names() -> None:
    """As those in two containers."""
    one, other = new_name(7), new_name(7)
    assert one != other
    for name in (one, other, f"{socket.gethostname()}:7"):  # the last as older versions named it
        assert is_here(name)
        assert is_here(name, 7)
        assert not is_here(name, 77)
    assert not is_here("elsewhere:7:abcd")


def test_a_worker_signs_and_signs_off(db: Database, settings: Settings) -> None:
    worker = Worker(db, settings)
    worker.signs.give()
    assert alive(db) == [worker.name]
    worker._close()
    assert alive(db) == []


def test_a_run_that_has_reached_its_goal_offers_nothing(db: Database, mine: Claim) -> None:
    for tick in (1, 2, 3):
        worker_side.post_query(db, mine, tick, "preference", 1, CLIPS)
    set_goal(db, mine.run_id, 2)
    first = lease(db, mine.run_id, "me")
    assert first is not None
    assert lease_ahead(db, mine.run_id, "me", [first.id]) is not None
    answer(db, first.id, "left", "me", "human")
    second = lease(db, mine.run_id, "me")
    assert second is not None
    assert lease_ahead(db, mine.run_id, "me", [second.id]) is None  # it would be the third
    answer(db, second.id, "left", "me", "human")
    assert lease(db, mine.run_id, "me") is None
    assert not may_lease(db, mine.run_id, "me")
    set_goal(db, mine.run_id, 3)
    assert lease(db, mine.run_id, "me") is not None


def test_it_rests_once_every_answer_is_heard(db: Database, mine: Claim) -> None:
    query = worker_side.post_query(db, mine, 1, "guidance", 1, CLIPS)
    set_goal(db, mine.run_id, 1)
    answer(db, query, "left", "me", "human")
    assert not worker_side.watch(db, [mine.run_id])[mine.run_id].idle
    worker_side.take_answer(db, mine, 2)
    assert worker_side.watch(db, [mine.run_id])[mine.run_id].idle
    set_goal(db, mine.run_id, None)
    assert not worker_side.watch(db, [mine.run_id])[mine.run_id].idle


def test_a_script_stops_at_its_goal_to_the_question(db: Database, settings: Settings) -> None:
    run = start(db, NewRun(world="unsafe-exploration", parent="scripted", goal=5)).id
    worker = Worker(db, settings)
    worker._claim()
    for _ in range(60):
        worker._round()
    assert get_run(db, run).answers == 5
    assert get_run(db, run).status == "active"
    tick = worker.sessions[run].last_tick
    add_operator_event(db, run, "change", {"kind": "change", "name": "p_guid", "value": 0.5})
    worker._round()
    assert worker.sessions[run].last_tick == tick  # at rest an event waits, too
    set_goal(db, run, 6)
    for _ in range(60):
        worker._round()
    assert get_run(db, run).answers == 6
    assert worker.sessions[run].saved.config.p_guid == 0.5


def test_a_pace_holds_ticks_back(db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch) -> None:
    run = start(db, NewRun(world="unsafe-exploration", preset="direct", parent="scripted", pace=4)).id
    worker = Worker(db, settings)
    now = [100.0]
    monkeypatch.setattr("parenting.server.session.time.monotonic", lambda: now[0])
    monkeypatch.setattr("parenting.server.worker.time.monotonic", lambda: now[0])
    worker._claim()
    worker._round()
    assert worker.sessions[run].last_tick == 1
    now[0] += 0.2
    worker._round()
    assert worker.sessions[run].last_tick == 1
    assert worker._soonest == pytest.approx(0.05)
    now[0] += 0.06
    worker._round()
    assert worker.sessions[run].last_tick == 2
    set_pace(db, run, None)
    worker._round()
    assert worker.sessions[run].last_tick > 2


def test_ticks_that_are_lived_again_do_not_keep_the_pace(db: Database) -> None:
    run = start(db, NewRun(world="unsafe-exploration", pace=0.001))
    (mine,) = claim(db, "first")
    worker_side.post_query(db, mine, 9, "guidance", 1, CLIPS)
    life = RunSession(db, mine, get_run(db, run.id), lambda: None)
    assert life.delay(0.001) == 0


@pytest.mark.parametrize("verb", [set_goal, set_pace])
def test_a_run_that_is_over_takes_neither(db: Database, run: Run, verb: object) -> None:
    set_status(db, run.id, RunStatus.STOPPED)
    assert callable(verb)
    with pytest.raises(Conflict, match="is stopped"):
        verb(db, run.id, 3)


def test_the_last_stage_never_ends(db: Database, mine: Claim) -> None:
    add_operator_event(db, mine.run_id, "mature", {"kind": "mature"})
    report_progress(db, mine, maturity=2)
    with pytest.raises(Conflict, match="is in its last stage, T = 2"):
        add_operator_event(db, mine.run_id, "mature", {"kind": "mature"})


def test_a_stopped_run_is_saved_as_it_was(db: Database, settings: Settings) -> None:
    run = start(db, NewRun(world="unsafe-exploration", parent="human")).id
    worker = Worker(db, settings)
    worker._claim()
    worker._round()
    tick = worker.sessions[run].last_tick
    assert tick > 0
    set_status(db, run, RunStatus.STOPPED)
    worker._round()
    assert load_checkpoints(db, run)[0].tick == tick


def test_who_asked_is_kept(db: Database, settings: Settings) -> None:
    run = start(db, NewRun(world="unsafe-exploration", parent="scripted", goal=8)).id
    worker = Worker(db, settings)
    worker._claim()
    for _ in range(60):
        worker._round()
    asked = [taken.query for taken in heard_answers(db, run)]
    assert {query.policy_stage for query in asked} == {1}
    steps = [query.policy_steps or 0 for query in asked]
    assert steps == sorted(steps)
    assert steps[0] == 0 < steps[-1]


def test_each_run_has_its_turn_in_every_round(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run that never asks takes no turn of the others, and waits for none."""
    worlds = ("reward-hacking", "unsafe-exploration", "side-effects")
    ids = [start(db, NewRun(world=world, preset="direct", parent="scripted")).id for world in worlds]
    waits = start(db, NewRun(world="unsafe-exploration", parent="human")).id
    monkeypatch.setattr(
        "parenting.server.work.held.SLICE_SECONDS", 0.0
    )  # a tick a turn, however fast the machine is
    worker = Worker(db, settings)
    worker._claim()
    for _ in range(25):
        worker._round()
    assert [worker.sessions[run].last_tick for run in ids] == [25, 25, 25]
    assert worker.sessions[waits].last_tick < 25
    assert get_run(db, waits).waiting == "guidance"
