"""Jobs in a worker: done beside its runs, which go on bit for bit as if nobody had asked."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import wait

import pytest

from parenting.server import jobs
from parenting.server.db import Database
from parenting.server.errors import BusyError
from parenting.server.new_run import NewRun, start
from parenting.server.runs import get_run
from parenting.server.settings import Settings
from parenting.server.statuses import JobState
from parenting.server.tables import Job
from parenting.server.work.jobs import LOOK_SECONDS
from parenting.server.worker import Worker
from tests.server.conftest import Clock
from tests.server.raising import same_bits

ONE_STORE = pytest.mark.only("sqlite", "what a worker does with a job depends on no store")


@pytest.fixture
def worker(db: Database, settings: Settings) -> Iterator[Worker]:
    worker = Worker(db, settings)
    yield worker
    worker._close()


def begin(db: Database, seed: int = 3) -> int:
    return start(db, NewRun(world="unsafe-exploration", parent="scripted", seed=seed, pace=None)).id


def ask(db: Database, run: int, kind: str = "walk") -> Job:
    return jobs.ask(db, run, kind, {"seed": 7} if kind == "walk" else {}, "me")


def ended(db: Database, worker: Worker, asked: Job) -> Job:
    """The job after a round of the worker and all that it began in it."""
    worker.jobs._looked_at = -1e9
    worker._round()
    wait(worker.jobs._working.values(), 60)
    return jobs.get(db, asked.public_id)


@pytest.mark.slow
def test_a_walk_and_a_policy_are_done_in_the_next_round(db: Database, worker: Worker) -> None:
    run = begin(db)
    worker._claim()
    for _ in range(6):
        worker._round()
    worker.sessions[run].save()
    saved = worker.sessions[run]._saved_tick
    found = ended(db, worker, ask(db, run))
    assert (found.state, found.reason) == (JobState.DONE, None)
    walk = found.result or {}
    clip = walk["clip"]
    assert clip["frames"][0]["agent"] == [1, 4]  # where an episode begins
    assert len(clip["frames"]) == clip["length"] + 1 == len(clip["actions"]) + 1
    assert saved <= walk["tick"] <= worker.sessions[run]._saved_tick  # the run may be saved again meanwhile
    assert walk["end"] in ("goal", "harm", "time")
    policy = ended(db, worker, ask(db, run, "policy")).result or {}
    assert all(abs(sum(one["probabilities"]) - 1) < 1e-5 for one in policy["cells"])
    assert len(policy["cells"]) == len({tuple(one["cell"]) for one in policy["cells"]}) > 10


@ONE_STORE
def test_the_same_seed_walks_the_same_way_and_another_one_does_not(db: Database, worker: Worker) -> None:
    run = begin(db)
    walks = [ended(db, worker, ask(db, run)).result for _ in range(2)]
    other = ended(db, worker, jobs.ask(db, run, "walk", {"seed": 8}, "me")).result
    assert walks[0] == walks[1]
    assert (other or {})["clip"]["actions"] != (walks[0] or {})["clip"]["actions"]


@pytest.mark.slow
@ONE_STORE
def test_a_life_is_the_same_with_and_without_walks(
    db: Database, worker: Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two runs of one seed live a tick in each round; beside one of them walks are taken."""
    monkeypatch.setattr("parenting.server.work.held.SLICE_SECONDS", 0.0)
    alone, watched = begin(db), begin(db)
    worker._claim()
    for number in range(22):
        worker._round()
        if number in (5, 12):
            assert ended(db, worker, ask(db, watched)).state is JobState.DONE
    one, other = worker.sessions[alone], worker.sessions[watched]
    assert one.last_tick == other.last_tick > 15
    assert same_bits(one.saved, other.saved) == []


def test_a_killed_workers_job_is_done_by_another(db: Database, worker: Worker, clock: Clock) -> None:
    asked = ask(db, begin(db))
    assert [mine.worker for mine in jobs.claim(db, "killed", 1)] == ["killed"]
    assert ended(db, worker, asked).state is JobState.WORKING
    clock.pass_seconds(6)
    found = ended(db, worker, asked)
    assert (found.state, found.worker) == (JobState.DONE, worker.name)


@ONE_STORE
def test_a_job_that_fails_says_why_and_the_worker_goes_on(
    db: Database, worker: Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise ValueError("the board has no start")

    run = begin(db)
    asked = ask(db, run)
    monkeypatch.setattr("parenting.server.work.doers.DOERS", {"walk": broken})
    found = ended(db, worker, asked)
    assert found.state is JobState.FAILED
    assert found.reason == "The worker could not do this (walk): ValueError: the board has no start"
    monkeypatch.undo()
    assert ended(db, worker, ask(db, run)).state is JobState.DONE
    assert get_run(db, run).status == "active"


@ONE_STORE
def test_a_worker_that_ends_gives_its_jobs_back(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    gate, begun = threading.Event(), threading.Event()

    def slow(*_: object) -> dict[str, int]:
        begun.set()
        assert gate.wait(60)
        return {"late": 1}

    monkeypatch.setattr("parenting.server.work.doers.DOERS", {"walk": slow})
    ending = Worker(db, settings)
    asked = ask(db, begin(db))
    ending._round()
    assert begun.wait(60)
    ending._close()
    assert jobs.get(db, asked.public_id).state is JobState.WAITING
    gate.set()
    wait(ending.jobs._working.values(), 60)
    assert jobs.get(db, asked.public_id).result is None  # its claim holds no more


@ONE_STORE
def test_a_job_is_looked_for_soon_after_the_store_refused(
    db: Database, worker: Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> bool:
        raise BusyError

    monkeypatch.setattr(jobs, "waits", refuse)
    worker.jobs._looked_at = -1e9
    with pytest.raises(BusyError):
        worker.jobs.begin(worker.name)
    looks = list[object]()
    monkeypatch.setattr(jobs, "waits", lambda *_: looks.append(True))
    worker.jobs._looked_at -= LOOK_SECONDS
    worker.jobs.begin(worker.name)
    assert looks == [True], "what it was told before is not forgotten"
