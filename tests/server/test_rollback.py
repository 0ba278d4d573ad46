"""A run is rolled back to a tick as a new run, which has the same bits there and goes its own way after."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import httpx2
import pytest
from sqlalchemy import func, select
from typer.testing import CliRunner

from parenting.agent import parenting
from parenting.commands.main import app
from parenting.parents.replay import ReplayParent
from parenting.server.counters import count
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError
from parenting.server.new_run import start
from parenting.server.queue import worker_side
from parenting.server.reads.record import StoredRecord
from parenting.server.replay import differences, relive
from parenting.server.rollback import roll_back
from parenting.server.runs import get_run
from parenting.server.settings import Settings
from parenting.server.snapshot import Snapshot
from parenting.server.tables import Answer, Metric, OperatorEvent, Query
from parenting.server.verify import verify
from tests.server.eventful_run import EVENTFUL, raise_eventful_run
from tests.server.test_origin import taken_up


@pytest.fixture
def eventful(db: Database, client: httpx2.Client, monkeypatch: pytest.MonkeyPatch) -> int:
    """A run of ninety ticks with every event that can happen."""
    monkeypatch.setattr("parenting.server.checkpoint_pace.CHECKPOINT_SECONDS", 1e9)
    return raise_eventful_run(db, client)


def states(db: Database, run: int, ticks: Sequence[int]) -> dict[int, Snapshot]:
    """The agent at some ticks, replayed without the queue."""
    world, found = EVENTFUL.make(), dict[int, Snapshot]()
    parent = ReplayParent(StoredRecord(db, run, world, EVENTFUL.config.max_clip_length))
    lived = EVENTFUL.initial_snapshot()
    for tick in range(1, max(ticks) + 1):
        state, _, answer, config, events = parenting.tick(world, lived.config, lived.state, parent)
        lived = Snapshot(state, count(world, lived.tally, answer, state, events), config)
        if tick in ticks:
            found[tick] = lived._replace(state=lived.state.clone())
    return found


def rows(db: Database, run: int) -> list[int | None]:
    tables: Sequence[Any] = (Query, Answer, OperatorEvent, Metric)
    with db.read() as session:
        return [session.scalar(select(func.count()).where(table.run_id == run)) for table in tables]


@pytest.mark.slow
def test_it_has_the_same_bits_at_the_tick_and_the_original_stays(
    db: Database, eventful: int, store: str
) -> None:
    run, before = eventful, rows(db, eventful)
    for tick, expected in states(db, run, (63,) if store == "postgresql" else (24, 63)).items():
        new = roll_back(db, run, tick)
        assert new.origin is not None
        assert new.origin["rolled_back"]["run"] == get_run(db, run).public_id
        life = taken_up(db, new.id)
        while life.last_tick < tick:
            seen = worker_side.watch(db, [new.id])[new.id]
            assert life.ready(seen)
            life.tick(seen)
        assert differences(life.saved, expected) == []
        life.save()
        assert relive(db, new.id).equal
        found = verify(db, new.id)
        assert (found.sound, found.x, found.chain.problems) == (True, None, [])
        assert found.chain.answers == get_run(db, new.id).answers > 3
    assert rows(db, run) == before
    assert verify(db, run).sound


@pytest.mark.only("sqlite")
def test_what_was_not_heard_by_then_is_asked_again(db: Database, eventful: int) -> None:
    run = eventful
    with db.read() as session:
        heard = session.scalars(
            select(Answer).where(Answer.run_id == run, Answer.applied_tick.is_not(None), Answer.standing)
        ).all()
        asked = {query.id: query.tick for query in session.scalars(select(Query).where(Query.run_id == run))}
    late = next(one for one in heard if (one.applied_tick or 0) > asked[one.query_id] + 1)
    tick = asked[late.query_id]
    new = roll_back(db, run, tick)
    with db.read() as session:
        copy = session.scalars(select(Query).where(Query.run_id == new.id, Query.tick == tick)).one()
        answers = session.scalars(select(Answer).where(Answer.query_id == copy.id)).all()
    assert (copy.status, list(answers)) == ("open", [])
    assert worker_side.high_water(db, new.id) == tick


@pytest.mark.only("sqlite")
def test_a_tick_that_was_not_lived_is_refused(db: Database, client: httpx2.Client) -> None:
    run = start(db, EVENTFUL.new("human"))
    with pytest.raises(InvalidFieldsError, match="has come to tick 0"):
        roll_back(db, run.id, 1)
    refused = client.post(f"/api/v1/runs/{run.id}/roll-back", json={"tick": 1})
    assert (refused.status_code, refused.json()["error"]["field"]) == (422, "tick")
    shown = client.post(f"/runs/{run.public_id}/roll-back", data={"roll_back": "1"})
    assert shown.status_code == 422
    made = client.post(f"/api/v1/runs/{run.id}/roll-back", json={"tick": 0, "name": "again"})
    assert (made.status_code, made.json()["name"], made.json()["origin"]["rolled_back"]["tick"]) == (
        201,
        "again",
        0,
    )
    led = client.post(f"/runs/{run.public_id}/roll-back", data={"roll_back": "0"})
    assert f"Up to tick 0 its record is that of run {run.id} ({run.public_id})." in led.text


@pytest.mark.only("sqlite")
def test_the_command_names_both_runs(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = start(db, EVENTFUL.new("human"))
    monkeypatch.setenv("PARENTING_DATA", str(settings.data))
    said = CliRunner().invoke(app, ["rollback", str(run.id), "--to", "0", "--name", "second"])
    assert (said.exit_code, said.stdout.startswith(f"Run 2 goes on from tick 0 of run {run.id}.")) == (
        0,
        True,
    )
    wrong = CliRunner().invoke(app, ["rollback", str(run.id), "--to", "7"])
    assert (wrong.exit_code, "--to: Run 1 has come to tick 0" in wrong.stderr) == (2, True)
