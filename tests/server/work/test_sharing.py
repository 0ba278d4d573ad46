"""Two workers raise as many runs each, whichever came first."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from parenting.server.checkpoints import load_checkpoints
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.runs import get_run, set_status
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from parenting.server.work.sharing import prospect, surplus
from parenting.server.worker import Worker
from parenting.server.workers import sign
from tests.server.conftest import Clock


@pytest.fixture
def pair(db: Database, settings: Settings) -> Iterator[tuple[Worker, Worker]]:
    one, other = Worker(db, settings), Worker(db, settings)
    one.name, other.name = "here:1", "here:2"
    yield one, other
    one._close()
    other._close()


def together(*workers: Worker) -> None:
    """Do as their loops do, until nothing changes hands any more."""
    for _ in range(4):
        for worker in workers:
            worker._claimed_at = -1e9
            worker.signs.give()
            worker._round()
            worker._claim()


def begin(db: Database, number: int) -> list[int]:
    return [start(db, NewRun(world="unsafe-exploration", parent="human")).id for _ in range(number)]


def test_the_share_is_rounded_up(db: Database) -> None:
    ids = begin(db, 5)
    assert prospect(db, "a", 5).share == 5
    sign(db, "b")
    assert prospect(db, "a", 5).share == 3
    set_status(db, ids[0], RunStatus.STOPPED)
    assert prospect(db, "a", 5).share == 2


def test_a_dead_worker_has_no_share_once_its_claims_lapse(db: Database, clock: Clock) -> None:
    begin(db, 4)
    sign(db, "dead")
    assert prospect(db, "a", 5).share == 2
    clock.pass_seconds(5.1)
    assert prospect(db, "a", 5).share == 4


@pytest.mark.parametrize(("held", "most", "given"), [(6, 3, 3), (5, 3, 2), (3, 3, 0), (2, 3, 0), (0, 0, 0)])
def test_the_surplus_is_taken_evenly(held: int, most: int, given: int) -> None:
    order = list(range(held))
    chosen = surplus(order, most)
    assert len(set(chosen)) == given
    assert set(chosen) <= set(order)
    if given > 1:
        assert max(chosen) - min(chosen) >= held // 2


def test_a_second_worker_gets_its_share_and_the_runs_go_on_as_they_were(
    db: Database, pair: tuple[Worker, Worker]
) -> None:
    one, other = pair
    ids = begin(db, 5)
    together(one)
    assert set(one.claims) == set(ids)
    ticks = {run_id: session.last_tick for run_id, session in one.sessions.items()}
    together(one, other)
    assert (len(one.claims), len(other.claims)) == (3, 2)
    assert not set(one.claims) & set(other.claims)
    for run_id, session in other.sessions.items():
        assert session.last_tick == ticks[run_id]
        assert load_checkpoints(db, run_id)[0].tick == ticks[run_id], "it was saved before it was given up"
        assert get_run(db, run_id).worker == other.name


def test_what_a_worker_leaves_is_taken_by_the_other(db: Database, pair: tuple[Worker, Worker]) -> None:
    one, other = pair
    ids = begin(db, 3)
    together(one, other)
    assert sorted(map(len, (one.claims, other.claims))) == [1, 2]
    other._close()
    together(one)
    assert set(one.claims) == set(ids)


def test_a_paused_run_is_given_up_too(db: Database, pair: tuple[Worker, Worker]) -> None:
    one, other = pair
    for run_id in begin(db, 2):
        set_status(db, run_id, RunStatus.PAUSED)
    together(one, other)
    assert (len(one.claims), len(other.claims)) == (1, 1)


def test_a_run_that_is_lost_just_then_is_not_given_up(
    db: Database, pair: tuple[Worker, Worker], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Turns drop claims in threads of their own."""
    one, _ = pair
    ids = begin(db, 2)
    together(one)
    for run_id in ids:
        one.sessions.pop(run_id, None)
    working = one.turns.working

    def lost(*seconds: float) -> set[int]:
        for run_id in list(one.held.surplus):
            one.held.drop(run_id)
        return working(*seconds)

    monkeypatch.setattr(one.turns, "working", lost)
    one._give_up(1)
    assert len(one.claims) == 1
