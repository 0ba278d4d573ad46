"""`parenting runs`: the newest first, and who waits for whom."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.commands.runs import COLUMNS
from parenting.server import runs
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.progress import report_progress
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.reads.schemas import run_schema
from parenting.server.runs import Claim
from parenting.server.statuses import RunStatus
from tests.server.conftest import CLIPS


@pytest.fixture
def mine(db: Database) -> Claim:
    """A run in a worker's hands."""
    start(db, NewRun(world="unsafe-exploration", name="[red]first", config={"stages": 2}))
    (only,) = runs.claim(db, "worker")
    return only


def listed(*arguments: str) -> list[str]:
    said = CliRunner().invoke(app, ["runs", *arguments])
    assert said.exit_code == 0, said.output
    return [line.rstrip() for line in said.stdout.splitlines() if line.strip(" ─")]


def now() -> str:
    """The line of the only run."""
    return listed()[-1]


def test_none_yet(db: Database) -> None:
    assert listed() == ["There are no runs yet. Start one on the pages: `parenting up`"]
    assert listed("--json") == ["[]"]


def test_a_line_each_newest_first(db: Database, mine: Claim) -> None:
    start(db, NewRun(world="reward-hacking", parent="scripted", goal=30))
    head, second, first = listed()
    assert head.split() == list(COLUMNS)
    assert second.split()[:2] == ["2", "reward-hacking"]
    assert "0 of 30" in second
    assert "[red]first" in first
    assert "1 of 2" in first
    assert [line.split() for line in listed("--limit", "1")[1:]] == [second.split()]


def test_a_narrow_terminal_gets_fewer_columns(
    db: Database, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.commands.runs.WIDE", 80)
    head, only = listed()
    assert head.split() == ["run", "world", "now", "stage", "tick", "answers", "optimal"]
    assert only.split() == ["1", "unsafe-exploration", "exploring", "1", "of", "2", "0", "0", "no"]


def test_who_waits_for_whom(db: Database, mine: Claim) -> None:
    assert "exploring" in now()
    report_progress(db, mine, tick=12, optimal=True)
    assert now().split()[-2:] == ["yes", mine.worker]
    query = post_query(db, mine, 12, "guidance", 1, CLIPS)
    assert "a question waits" in now()
    answer(db, query, "left", "me", "human")
    report_progress(db, mine, waiting="stuck")
    assert "no action acceptable" in now()
    runs.set_goal(db, mine.run_id, 1)
    assert "goal reached" in now()
    assert "1 of 1" in now()
    runs.set_status(db, mine.run_id, RunStatus.PAUSED)
    assert "paused" in now()
    runs.finish(db, mine, RunStatus.FINISHED, "Its argmax policy is optimal.")
    assert "finished" in now()


def test_no_worker(db: Database) -> None:
    start(db, NewRun(world="unsafe-exploration"))
    assert "no worker" in now()


def test_as_json_it_is_what_the_api_says(db: Database, mine: Claim) -> None:
    (text,) = listed("--json")
    assert json.loads(text) == [run_schema(db, 1).model_dump(mode="json")]


def test_it_says_which_worker_raises_which_run(db: Database, mine: Claim) -> None:
    start(db, NewRun(world="unsafe-exploration"))
    head, second, first = listed()
    assert head.split()[-1] == "worker"
    assert first.split()[-1] == "worker"  # the name of the one that claimed it
    assert not second.rstrip().endswith("worker")
