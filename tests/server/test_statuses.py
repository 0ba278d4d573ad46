"""Statuses: every one has its sentence, and the state of a run is the first in the list that holds."""

from __future__ import annotations

from enum import StrEnum

import pytest
from sqlalchemy import text
from sqlalchemy.exc import IntegrityError

from parenting.server import runs, workers
from parenting.server.db import Database
from parenting.server.errors import BusyError
from parenting.server.new_run import NewRun, start
from parenting.server.progress import report_progress
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.reads.schemas import FORGIVEN, SILENT_AFTER, run_schema, run_schemas
from parenting.server.runs import Claim
from parenting.server.schemas import RunSchema
from parenting.server.statuses import (
    JOB_STATES,
    QUERY_STATUSES,
    RUN_STATES,
    RUN_STATUSES,
    STATE_LABELS,
    WAITING,
    JobState,
    QueryStatus,
    RunState,
    RunStatus,
    Waiting,
)
from tests.server.conftest import CLIPS, Clock


@pytest.mark.parametrize(
    ("words", "sentences"),
    [
        (RunStatus, RUN_STATUSES),
        (QueryStatus, QUERY_STATUSES),
        (Waiting, WAITING),
        (JobState, JOB_STATES),
        (RunState, RUN_STATES),
        (RunState, STATE_LABELS),
    ],
)
def test_every_status_is_explained(words: type[StrEnum], sentences: dict[StrEnum, str]) -> None:
    assert list(words) == list(sentences)


@pytest.mark.parametrize("column", ["run.status", "run.waiting", "query.status"])
def test_the_database_refuses_an_unknown_status(db: Database, guidance: int, column: str) -> None:
    table, _, name = column.partition(".")
    with pytest.raises(IntegrityError, match=rf"(?i)CHECK.*{name}"), db.write() as session:
        session.execute(text(f"UPDATE {table} SET {name} = 'lost'"))


def test_statuses_come_back_as_members(db: Database, mine: Claim) -> None:
    report_progress(db, mine, waiting="stuck")
    run = runs.get_run(db, mine.run_id)
    assert run.status is RunStatus.ACTIVE
    assert run.waiting is Waiting.STUCK


def state(db: Database, run: int = 1) -> RunState:
    return run_schema(db, run).state


def test_each_state_hides_those_behind_it(db: Database, mine: Claim) -> None:
    assert state(db) is RunState.EXPLORING
    report_progress(db, mine, waiting="stuck")
    assert state(db) is RunState.STUCK
    query = post_query(db, mine, 12, "preference", 1, CLIPS)
    runs.let_go(db, [mine])
    assert state(db) is RunState.QUESTION  # a person may answer while no worker is there
    answer(db, query, "left", "me", "human")
    assert state(db) is RunState.NO_WORKER
    runs.set_goal(db, mine.run_id, 1)
    assert state(db) is RunState.RESTING
    runs.set_status(db, mine.run_id, RunStatus.PAUSED)
    assert state(db) is RunState.PAUSED
    runs.set_status(db, mine.run_id, RunStatus.STOPPED)
    assert state(db) is RunState.OVER


def test_a_question_to_a_script_waits_for_nobody(db: Database) -> None:
    start(db, NewRun(world="unsafe-exploration", parent="scripted"))
    (mine,) = runs.claim(db, "test")
    post_query(db, mine, 1, "guidance", 1, CLIPS)
    assert state(db) is RunState.EXPLORING


def test_a_new_run_has_a_worker_where_one_is_alive(db: Database, clock: Clock) -> None:
    started = start(db, NewRun(world="unsafe-exploration")).id
    assert run_schema(db, started).worker == "silent"
    assert state(db, started) is RunState.NO_WORKER
    workers.sign(db, "somebody")
    assert run_schema(db, started).worker == "alive"
    assert state(db, started) is RunState.EXPLORING
    clock.pass_seconds(workers.SILENT_SECONDS + 1)
    assert state(db, started) is RunState.NO_WORKER


def test_a_living_worker_does_not_hide_that_the_one_of_a_run_is_silent(
    db: Database, mine: Claim, clock: Clock
) -> None:
    clock.pass_seconds(SILENT_AFTER.total_seconds() + 1)
    workers.sign(db, "somebody else")
    assert run_schema(db, mine.run_id).worker == "silent"


def test_a_worker_that_cannot_sign_is_not_missed(
    db: Database, mine: Claim, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While the store refuses, and for five minutes at most: a copy that nobody may write has no worker."""
    clock.pass_seconds(SILENT_AFTER.total_seconds() + 1)
    assert state(db, mine.run_id) is RunState.NO_WORKER
    monkeypatch.setattr(db, "refusal", BusyError)
    assert state(db, mine.run_id) is RunState.EXPLORING
    (listed,) = run_schemas(db, [runs.get_run(db, mine.run_id)])
    assert isinstance(listed, RunSchema)
    assert listed.state is RunState.EXPLORING
    clock.pass_seconds(FORGIVEN.total_seconds())
    assert state(db, mine.run_id) is RunState.NO_WORKER
