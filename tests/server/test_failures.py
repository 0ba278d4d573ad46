"""The reasons of failures: sentences, without the statements of the store."""

from __future__ import annotations

import pytest
from sqlalchemy.exc import DBAPIError, StatementError

from parenting.server.db import Database
from parenting.server.failures import said_by
from parenting.server.jobs import JobClaim
from parenting.server.new_run import NewRun, start
from parenting.server.runs import get_run, set_status
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from parenting.server.tables import Run
from parenting.server.work.jobs import _reason
from parenting.server.worker import Worker
from tests.server.conftest import Clock

SQL = "UPDATE run SET milestones=? WHERE id = ?"


@pytest.mark.only("sqlite", "no store is asked")
@pytest.mark.parametrize(
    ("error", "said"),
    [
        (
            StatementError("(builtins.ValueError) nan", SQL, {"id": 7}, ValueError("nan\nLINE 2")),
            "ValueError: nan",
        ),
        (DBAPIError(SQL, {"id": 7}, KeyError()), "KeyError"),
        (StatementError("no cause", SQL, {"id": 7}, None), "StatementError"),
        (ArithmeticError("no such policy"), "no such policy"),
    ],
)
def test_a_reason_holds_no_statement(error: Exception, said: str) -> None:
    assert said_by(error) == said


@pytest.mark.only("sqlite", "no store is asked")
def test_neither_does_that_of_a_job() -> None:
    told = _reason(JobClaim(1, 1, "walk", {}, "worker", 1), StatementError("", SQL, {}, ValueError("nan")))
    assert told == "The worker could not do this (walk): ValueError: nan"


@pytest.mark.parametrize("name", ["learning_rate", "lambda_local"])
def test_a_policy_that_is_not_finite_fails_its_run_with_a_remedy(
    db: Database, clock: Clock, settings: Settings, name: str
) -> None:
    """A run of an older version, which took any number."""
    run = start(db, NewRun(world="unsafe-exploration", parent="scripted", seed=4)).id
    with db.write() as session:
        stored = session.get_one(Run, run)
        stored.config = {**stored.config, name: 1e308}
    worker = Worker(db, settings)
    for _ in range(2):  # a resumed run says the same
        clock.pass_seconds(10)
        worker._claimed_at = -1.0
        worker._claim()
        while run in worker.claims:
            worker._round()
        failed = get_run(db, run)
        assert failed.status == "failed"
        assert failed.reason is not None
        tick = int(failed.reason.partition("at tick ")[2].partition(":")[0])
        assert failed.reason == (
            f"The policy's weights are no longer finite at tick {tick}: "
            f"a smaller {name} than 1e+308 is needed."
        )
        set_status(db, run, RunStatus.ACTIVE)
    worker._close()
