"""Statuses: every one has its sentence, and the state of a run is the first in the list that holds."""

from __future__ import annotations

from enum import StrEnum

import pytest
from sqlalchemy import text
from sqlalchemy.exc import IntegrityError

from parenting.server import runs
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.reads.schemas import run_schema
from parenting.server.runs import Claim
from parenting.server.statuses import (
    QUERY_STATUSES,
    RUN_STATES,
    RUN_STATUSES,
    STATE_LABELS,
    WAITING,
    QueryStatus,
    RunState,
    RunStatus,
    Waiting,
)
from tests.server.conftest import CLIPS


@pytest.mark.parametrize(
    ("words", "sentences"),
    [
        (RunStatus, RUN_STATUSES),
        (QueryStatus, QUERY_STATUSES),
        (Waiting, WAITING),
        (RunState, RUN_STATES),
        (RunState, STATE_LABELS),
    ],
)
def test_every_status_is_explained(words: type[StrEnum], sentences: dict[StrEnum, str]) -> None:
    assert list(words) == list(sentences)


@pytest.mark.parametrize("column", ["run.status", "run.waiting", "query.status"])
def test_the_database_refuses_an_unknown_status(db: Database, guidance: int, column: str) -> None:
    table, _, name = column.partition(".")
    with pytest.raises(IntegrityError, match=rf"CHECK.*{name}"), db.write() as session:
        session.execute(text(f"UPDATE {table} SET {name} = 'lost'"))


def test_statuses_come_back_as_members(db: Database, mine: Claim) -> None:
    runs.report_progress(db, mine, waiting="stuck")
    run = runs.get_run(db, mine.run_id)
    assert run.status is RunStatus.ACTIVE
    assert run.waiting is Waiting.STUCK


def state(db: Database, run: int = 1) -> RunState:
    return run_schema(db, run).state


def test_each_state_hides_those_behind_it(db: Database, mine: Claim) -> None:
    assert state(db) is RunState.EXPLORING
    runs.report_progress(db, mine, waiting="stuck")
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
