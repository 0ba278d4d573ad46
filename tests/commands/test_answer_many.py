"""`parenting answer --people`: a crowd against a server."""

from __future__ import annotations

import json
import os
import signal
import socket
import threading
import time
from collections import Counter
from collections.abc import Iterator

import pytest
import uvicorn
from structlog.testing import capture_logs
from typer.testing import CliRunner, Result

from parenting.commands.crowd import MOST_RUNS, chosen_runs
from parenting.commands.crowd_figures import percentiles
from parenting.commands.errors import UsageError
from parenting.commands.main import app
from parenting.server import runs
from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.reads.answers import every
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from parenting.server.worker import Worker
from tests.commands.asking import begin
from tests.server.serving import free_port, until_up


@pytest.fixture
def url(settings: Settings, db: Database) -> Iterator[str]:
    """A server and a worker in threads."""
    listener = socket.create_server(("127.0.0.1", 0))
    application = create_app(settings, db)
    server = uvicorn.Server(uvicorn.Config(application, log_config=None, timeout_graceful_shutdown=1))
    worker = Worker(db, settings)
    threads = [
        threading.Thread(target=server.run, kwargs={"sockets": [listener]}),
        threading.Thread(target=worker.work),
    ]
    with capture_logs():
        for thread in threads:
            thread.start()
        address = f"http://127.0.0.1:{listener.getsockname()[1]}"
        until_up(address)
        yield address
        worker.stop()
        application.state.streams.close()
        server.should_exit = True
        for thread in threads:
            thread.join(10)


def answer(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["answer", *arguments])


def until_answered(db: Database) -> None:
    """Wait until somebody has answered something."""
    while not any(run.answers for run in runs.list_runs(db)):
        time.sleep(0.05)


def test_three_people_answer_two_runs_in_their_own_names(db: Database, url: str) -> None:
    for seed in range(2):
        begin(db, seed=seed)
    said = answer("--url", url, "--people", "3", "--think", "0.01", "--limit", "12", "--json")
    assert said.exit_code == 0, said.output
    found = json.loads(said.stdout)
    rows = [row.answer for run in (1, 2) for row in every(db, run)]
    assert found["answered"] == len(rows) >= 12
    assert len({row.client_id for row in rows}) == 3
    by_run = Counter(row.run_id for row in rows)
    assert (found["runs"], found["least_of_a_run"]) == (2, min(by_run.values()))
    assert found["ended"] == "These are the 12 that were wanted."
    assert 0 < found["answer_ms"]["p50"] <= found["answer_ms"]["p99"]
    assert found["errors"] == {}


@pytest.mark.slow
def test_a_crowd_starts_a_run_for_each_and_leaves_once_all_are_over(
    db: Database, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.commands.crowd.WAIT", 0.2)

    def stop() -> None:
        until_answered(db)
        for run in runs.list_runs(db):
            runs.set_status(db, run.id, RunStatus.STOPPED, "Stopped by the operator.")

    stopper = threading.Thread(target=stop)
    stopper.start()
    said = answer("--url", url, "--people", "2", "--think", "0.05", "--start", "unsafe-exploration")
    stopper.join()
    assert said.exit_code == 0, said.output
    assert [run.seed for run in runs.list_runs(db)] == [1, 0]
    assert said.stdout.endswith("All runs are over or rest.\n")
    assert "2 people answered" in said.stdout


@pytest.mark.slow
def test_ctrl_c_ends_a_crowd_with_its_summary(db: Database, url: str) -> None:
    begin(db)

    def stop() -> None:
        until_answered(db)
        os.kill(os.getpid(), signal.SIGINT)

    stopper = threading.Thread(target=stop)
    stopper.start()
    said = answer("--url", url, "--people", "2", "--think", "0.05")
    stopper.join()
    assert said.exit_code == 130, said.output
    assert said.stdout.startswith("2 people answered ")
    assert said.stdout.endswith("\nStopped.\n")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--people", "2"], "Start one with `parenting up`, or name another."),
        (["--people", "2", "--run", "1"], "--run: it does not go with --people."),
        (["--people", "2", "--runs", "1", "--start", "x"], "--runs: with --start the crowd answers"),
        ([], "--run: name a run to answer, or with --people"),
    ],
)
def test_what_is_wrong_is_said(arguments: list[str], sentence: str) -> None:
    said = answer("--url", f"http://127.0.0.1:{free_port()}", *arguments)
    assert (said.exit_code, said.stdout) == (2, "")
    assert sentence in said.stderr


def test_the_runs_of_a_crowd_can_be_named() -> None:
    assert chosen_runs("3,1-3, 9") == [3, 1, 2, 9]
    for wrong in ("", "a", "3-1", "1,,2", "-1"):
        with pytest.raises(UsageError, match="--runs"):
            chosen_runs(wrong)


def test_too_many_runs_are_refused_before_they_are_counted_out() -> None:
    assert len(chosen_runs(f"1-{MOST_RUNS}")) == MOST_RUNS
    for wrong in ("5-99999999999", f"0-{MOST_RUNS}", f"1-{MOST_RUNS},7", f"1-{'9' * 4000}"):
        with pytest.raises(UsageError, match=f"--runs: .* names too many runs. Name at most {MOST_RUNS}"):
            chosen_runs(wrong)
    with pytest.raises(UsageError, match="cannot be read"):
        chosen_runs("9" * 5000)


def test_percentiles_lie_between_the_least_and_the_most() -> None:
    assert percentiles([]) is None
    assert percentiles([0.002]) == {"p50": 2.0, "p90": 2.0, "p99": 2.0, "max": 2.0}
    found = percentiles([n / 1000 for n in range(101)])
    assert found is not None
    assert [round(found[name]) for name in ("p50", "p90", "max")] == [50, 90, 100]
