"""Runs: their operator's verbs, one worker each, signs of life."""

import pytest

from parenting.server.db import Database
from parenting.server.errors import Conflict, LostClaimError, NotFound
from parenting.server.new_run import NewRun, start
from parenting.server.progress import report_progress
from parenting.server.queue.answers import get_query
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim as ClaimOf
from parenting.server.runs import claim, finish, get_run, let_go, list_runs, set_status
from parenting.server.statuses import OVER, RunStatus
from parenting.server.tables import Run
from parenting.server.workers import sign
from tests.server.conftest import CLIPS, Clock


def test_newest_run_stands_first(db: Database, run: Run) -> None:
    second = start(db, NewRun(world="unsafe-exploration"))
    assert [found.id for found in list_runs(db)] == [second.id, run.id]


def test_unknown_run(db: Database) -> None:
    with pytest.raises(NotFound, match="no run 7"):
        get_run(db, 7)


@pytest.mark.parametrize("status", [RunStatus.PAUSED, RunStatus.STOPPED])
def test_doing_it_twice_is_doing_it_once(db: Database, run: Run, status: RunStatus) -> None:
    set_status(db, run.id, status)
    assert set_status(db, run.id, status).status == status


def test_paused_and_stopped_runs_go_on(db: Database, run: Run) -> None:
    set_status(db, run.id, RunStatus.PAUSED)
    assert set_status(db, run.id, RunStatus.ACTIVE).status == "active"
    set_status(db, run.id, RunStatus.STOPPED, "Enough.")
    assert get_run(db, run.id).reason == "Enough."
    with pytest.raises(Conflict, match="is stopped; it cannot become paused"):
        set_status(db, run.id, RunStatus.PAUSED)
    assert set_status(db, run.id, RunStatus.ACTIVE).reason is None


def test_one_worker_a_run(db: Database, run: Run, clock: Clock) -> None:
    assert [mine.run_id for mine in claim(db, "a")] == [run.id]
    assert claim(db, "b") == []
    clock.pass_seconds(4)
    assert claim(db, "b") == []
    clock.pass_seconds(2)
    assert [mine.fencing_token for mine in claim(db, "b")] == [2]


def test_a_sign_of_life_keeps_every_claim_of_its_worker(db: Database, mine: ClaimOf, clock: Clock) -> None:
    """Signs of others keep nothing of it."""
    for _ in range(3):
        clock.pass_seconds(4)
        sign(db, mine.worker)
        assert claim(db, "b") == []
    clock.pass_seconds(6)
    sign(db, "c")
    assert [theirs.run_id for theirs in claim(db, "b")] == [mine.run_id]


def test_run_that_was_let_go_is_free_at_once(db: Database, mine: ClaimOf) -> None:
    let_go(db, [mine])
    (next_claim,) = claim(db, "b")
    let_go(db, [mine])  # too late: another's by now
    assert get_run(db, mine.run_id).worker == "b"
    assert next_claim.fencing_token == 2


@pytest.mark.parametrize("status", OVER)
def test_run_that_is_over_is_not_claimed(db: Database, run: Run, mine: ClaimOf, status: RunStatus) -> None:
    let_go(db, [mine])
    set_status(db, run.id, status)
    assert claim(db, "b") == []


def test_report_shows_where_the_agent_is(db: Database, mine: ClaimOf) -> None:
    report_progress(db, mine, tick=12, waiting="guidance", optimal=True, versions={"torch": "2.13"})
    found = get_run(db, mine.run_id)
    assert (found.tick, found.waiting, found.optimal, found.versions) == (
        12,
        "guidance",
        True,
        {"torch": "2.13"},
    )
    report_progress(db, mine, waiting=None)
    assert get_run(db, mine.run_id).waiting is None
    with pytest.raises(TypeError, match="seed"):
        report_progress(db, mine, seed=3)


def test_finished_run_withdraws_what_is_open_and_keeps_its_reason(
    db: Database, mine: ClaimOf, guidance: int
) -> None:
    finish(db, mine, RunStatus.FAILED, "It diverged.", "details")
    found = get_run(db, mine.run_id)
    assert (found.status, found.reason, found.error) == ("failed", "It diverged.", "details")
    assert get_query(db, guidance).status == "withdrawn"
    assert finish(db, mine, RunStatus.FINISHED, "Too late.").status == "failed"


def test_finish_is_fenced(db: Database, mine: ClaimOf, clock: Clock) -> None:
    clock.pass_seconds(6)
    claim(db, "b")
    with pytest.raises(LostClaimError):
        finish(db, mine, RunStatus.FINISHED, "It is optimal.")
    assert get_run(db, mine.run_id).status == "active"


def test_stopping_touches_its_own_run_only(db: Database, run: Run, mine: ClaimOf, guidance: int) -> None:
    other = start(db, NewRun(world="unsafe-exploration"))
    (theirs,) = claim(db, "b")
    theirs_open = post_query(db, theirs, 5, "guidance", 1, CLIPS)
    set_status(db, run.id, RunStatus.STOPPED)
    assert get_query(db, guidance).status == "withdrawn"
    assert get_query(db, theirs_open).status == "open"
    assert get_run(db, other.id).status == "active"
