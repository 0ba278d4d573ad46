"""A run in each world and built-in level, from its start to a checkpoint.

It is trained by a script behind the database, and by a parent who knows nothing but the lease reply. Each
equals the run in tensors. Runs at T = 1, and each world's first level through HTTP, are in test_same_bits.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
from fastapi.testclient import TestClient
from structlog.testing import capture_logs

from parenting.agent.config import v1_names
from parenting.envs import registry
from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue import worker_side
from parenting.server.reads.metrics import list_metrics
from parenting.server.runs import claim, get_run, set_status
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from parenting.server.tables import Weights
from parenting.server.worker import Worker
from tests.database import migrated
from tests.server.raising import Begun, inline, last, same_bits, script

LEVELS = [(kind.name, level) for kind in registry.WORLDS.values() for level in kind.levels]
TWO_STAGES = {"max_open_preferences": 0, "stages": 2, "mature_every": 6, "time_limit": 10}
"""Clips of up to two steps, a maturation, truncations. No open preferences: so each answer is heard in the
tick after its question, as in the run in tensors.
"""
TICKS = 44

LONGER = [Begun(world, level, TWO_STAGES) for world, level in LEVELS]
LONGER.append(Begun("absent-supervisor", "supervisor", {**TWO_STAGES, "supervised": "random"}))
LONGER.append(Begun("reward-hacking", "garden", {**TWO_STAGES, "inside": "left"}))
FIRST = [next(iter(kind.levels)) for kind in registry.WORLDS.values()]
ELSEWHERE = [begun for begun in LONGER if begun.level not in FIRST or begun.changes != TWO_STAGES]


def name(begun: Begun) -> str:
    changes = set(begun.changes.values()) & {"random", "left"}
    return "-".join([begun.level, f"T={begun.config.max_clip_length}", *changes])


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(data=tmp_path)


@pytest.fixture
def db(settings: Settings) -> Iterator[Database]:
    database = migrated(settings)
    yield database
    database.close()


def taken_up(db: Database, run: int) -> RunSession:
    """The run in the hands of a new worker."""
    (mine,) = claim(db, "test", -1)  # taken from whoever has it
    return RunSession(db, mine, get_run(db, run), lambda: None)


def live_to(life: RunSession, tick: int) -> None:
    while life.last_tick < tick:
        seen = worker_side.watch(life.db, [life.claim.run_id])[life.claim.run_id]
        assert life.ready(seen), life.saved.state.all_refused
        life.tick(seen)


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("begun", LONGER, ids=name)
def test_a_script_raises_it(db: Database, begun: Begun) -> None:
    run = start(db, begun.new("scripted")).id
    first = taken_up(db, run)
    live_to(first, TICKS // 2)
    first.save()
    second = taken_up(db, run)
    assert second.last_tick == TICKS // 2
    live_to(second, TICKS)
    second.save()
    saved = last(db, run, begun)
    assert int(saved.state.maturity) == begun.config.max_clip_length  # so it has heard answers, if it has two
    assert same_bits(saved, inline(TICKS, begun)) == []
    assert list_metrics(db, run)


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("begun", ELSEWHERE, ids=name)
def test_the_lease_reply_is_all_that_a_parent_needs(settings: Settings, db: Database, begun: Begun) -> None:
    """Worker and web in one process, so that nothing but their order is left to chance: there is none."""
    run = start(db, begun.new("human")).id
    life = taken_up(db, run)
    with TestClient(create_app(settings, db), base_url="http://localhost") as web:
        parent = script(web, run)
        while life.last_tick < TICKS:
            seen = worker_side.watch(db, [run])[run]
            if life.ready(seen):
                life.tick(seen)
            else:
                assert parent.answer_one(), life.waiting
    life.save()
    assert get_run(db, run).answers > 0
    assert same_bits(last(db, run, begun), inline(life.last_tick, begun)) == []


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("world", list(registry.WORLDS))
def test_it_begins_by_its_name_alone(settings: Settings, db: Database, world: str) -> None:
    """`{"world": ...}` is enough: the world's defaults hold, and its weights are in the database."""
    with TestClient(create_app(settings, db), base_url="http://localhost") as web:
        run: dict[str, Any] = _good(web.post("/api/v1/runs", json={"world": world}), 201)
        defaults = v1_names(registry.defaults(world))
        assert {name: run["config"][name] for name in defaults} == defaults
        life = taken_up(db, run["id"])
        seen = worker_side.watch(db, [run["id"]])[run["id"]]
        while life.ready(seen):
            life.tick(seen)
            seen = worker_side.watch(db, [run["id"]])[run["id"]]
        question = _good(web.post("/api/v1/runs/1/queries/lease", json={"client_id": "me"}), 200)
    assert question["world"]["text"] == registry.level(world).text
    assert question["kind"] == "guidance"
    assert life.saved.config.pretrain == (get_run(db, run["id"]).weights is not None)


def test_damaged_weights_fail_their_run_alone(settings: Settings, db: Database) -> None:
    damaged = start(db, NewRun(world="side-effects", parent="scripted")).id
    sound = start(db, NewRun(world="interruptibility", parent="scripted")).id
    with db.write() as session:
        row = session.get(Weights, get_run(db, damaged).weights)
        assert row is not None
        row.blob = row.blob[:-1] + bytes([row.blob[-1] ^ 1])
    worker = Worker(db, settings)
    worker._claim()
    with capture_logs() as said:  # structlog's own output may be a file that an earlier test has closed
        for _ in range(3):
            worker._round()
    assert [line["event"] for line in said if line["log_level"] == "error"] == ["run failed"]
    failed = get_run(db, damaged)
    assert failed.status == "failed"
    assert failed.reason is not None
    assert "pre-trained weights" in failed.reason
    assert get_run(db, sound).status in ("active", "finished")
    with TestClient(create_app(settings, db), base_url="http://localhost") as web:
        page = web.get(f"/runs/{damaged}").text
    assert "are not in the database, or are damaged" in page
    assert "Traceback" not in page


@pytest.mark.slow
def test_a_garden_goes_on_until_it_is_stopped(settings: Settings, db: Database) -> None:
    """No policy is optimal there, so a scripted parent always has more to teach."""
    run = start(db, NewRun(world="reward-hacking", parent="scripted")).id
    worker = Worker(db, settings)
    worker._claim()
    while not list_metrics(db, run):
        worker._round()
    row = list_metrics(db, run)[0].values
    assert 0 <= row["return"] < 100
    assert row["optimal_return"] > 40  # what the parent's own way waters in a hundred steps
    assert row["optimal"] == 0
    assert not worker.sessions[run].finished()
    assert get_run(db, run).status == "active"
    set_status(db, run, RunStatus.STOPPED)
    worker._round()
    assert run not in worker.sessions


@pytest.mark.slow
def test_a_dear_look_is_not_taken_at_each_answer(settings: Settings, db: Database) -> None:
    """In the garden seconds lie between two rows; what is left over is written while the agent waits."""
    life = taken_up(db, start(db, NewRun(world="reward-hacking", parent="human")).id)
    run = life.claim.run_id
    life.evaluation.refresh_seconds = 1e9
    with TestClient(create_app(settings, db), base_url="http://localhost") as web:
        parent = script(web, run)
        while life.last_tick < 30:
            seen = worker_side.watch(db, [run])[run]
            if life.ready(seen):
                life.tick(seen)
            else:
                life.report_waiting(seen)
                assert parent.answer_one()
    assert not list_metrics(db, run)
    life.evaluation.refresh_seconds = 0.0
    while life.ready(seen := worker_side.watch(db, [run])[run]):
        life.tick(seen)
    life.report_waiting(seen)
    newest = list_metrics(db, run)[-1]
    assert (newest.tick, newest.values["guidance"]) == (life.last_tick, int(life.saved.tally.kinds[0, 1]))
    assert get_run(db, run).waiting == "guidance"


def _good(reply: httpx2.Response, status: int) -> Any:
    assert reply.status_code == status, reply.text
    return reply.json()
