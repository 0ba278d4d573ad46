"""The runs of a worker that ends, or is silent for the time of a claim, are taken by another within 5 s."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from parenting.server.checkpoints import load_checkpoints
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.runs import get_run
from parenting.server.settings import Settings
from parenting.server.worker import CLAIM_EVERY, Worker
from tests.server.conftest import Clock

WITHIN_SECONDS = 5.0
"""After the claim has lapsed."""


@pytest.fixture
def pair(db: Database, settings: Settings) -> Iterator[tuple[Worker, Worker]]:
    """One worker that raises two runs, and another that has none."""
    one, other = Worker(db, settings), Worker(db, settings)
    one.name, other.name = "here:1", "here:2"
    for _ in range(2):
        start(db, NewRun(world="unsafe-exploration", parent="human"))
    go_on(one)
    assert len(one.sessions) == 2
    yield one, other
    one._close()
    other._close()


def go_on(worker: Worker) -> None:
    """Do as its loop does, a few rounds."""
    for _ in range(4):
        worker._claimed_at = -1e9
        worker.signs.give()
        worker._round()
        worker._claim()


def test_a_silent_workers_runs_are_raised_elsewhere_once_its_claims_lapse(
    db: Database, settings: Settings, pair: tuple[Worker, Worker], clock: Clock
) -> None:
    """SIGKILL and SIGSTOP look the same to others: no sign of life comes."""
    one, other = pair
    clock.pass_seconds(settings.claim_seconds - 0.1)
    go_on(other)
    assert not other.claims, "its claims hold still"
    clock.pass_seconds(0.2)
    go_on(other)
    assert set(other.claims) == set(one.claims)
    assert {get_run(db, run_id).worker for run_id in other.claims} == {other.name}


@pytest.mark.parametrize("seconds", [1.0, 5.0, 600.0])
def test_a_quiet_worker_looks_often_enough_whatever_a_claim_lasts(
    db: Database, settings: Settings, seconds: float
) -> None:
    worker = Worker(db, settings.model_copy(update={"claim_seconds": seconds}))
    worker._claim()
    start(db, NewRun(world="unsafe-exploration", parent="human"))
    worker._committed = False
    worker._claimed_at -= min(seconds / 2, WITHIN_SECONDS - CLAIM_EVERY)
    worker._claim()
    assert len(worker.claims) == 1
    worker._close()


def test_a_worker_that_ends_saves_each_run_before_it_gives_it_up(
    db: Database, pair: tuple[Worker, Worker]
) -> None:
    """As one that `up --workers auto` ends for being idle, and one that gets SIGTERM."""
    one, other = pair
    ticks = {run_id: session.last_tick for run_id, session in one.sessions.items()}
    assert min(ticks.values()) > 0
    one._close()
    assert {run_id: load_checkpoints(db, run_id)[0].tick for run_id in ticks} == ticks
    go_on(other)
    assert {run_id: session.last_tick for run_id, session in other.sessions.items()} == ticks
