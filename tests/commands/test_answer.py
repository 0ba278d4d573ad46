"""`parenting answer`: when it ends, with which exit code, and what it says."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import httpx2
import pytest
from structlog.testing import capture_logs
from typer.testing import CliRunner, Result

from parenting.commands.main import app
from parenting.server import operator_events, runs
from parenting.server.db import Database
from parenting.server.progress import report_progress
from parenting.server.queue import answers, leases
from parenting.server.reads.answers import every
from parenting.server.settings import Settings
from parenting.server.statuses import OVER, RunStatus
from parenting.server.worker import Worker
from tests.commands.asking import asked, begin
from tests.server.serving import free_port, parenting


@pytest.fixture
def raising(settings: Settings, db: Database, web: httpx2.Client) -> Iterator[None]:
    """A worker in a thread."""
    worker = Worker(db, settings)
    thread = threading.Thread(target=worker.work)
    with capture_logs():  # the worker's log would stand between the command's words
        thread.start()
        yield
        worker.stop()
        thread.join()


def answer(*arguments: str, run: int = 1) -> Result:
    return CliRunner().invoke(app, ["answer", "--run", str(run), *arguments])


# How it ends


@pytest.mark.slow
def test_a_limit(db: Database, raising: None, tmp_path: Path) -> None:
    run = begin(db)
    said = answer("--limit", "6", "--receipts", str(tmp_path / "receipts"))
    assert said.exit_code == 0, said.output
    assert said.stdout.startswith("Run 1: answered 6 (")
    assert said.stdout.endswith("). These are the 6 that were wanted.\n")
    rows = [row.answer for row in every(db, run)]
    receipts = [json.loads(line) for line in (tmp_path / "receipts").read_text().splitlines()]
    assert [(row["number"], row["query"], row["choice"]) for row in receipts] == [
        (row.number, row.query_id, row.choice) for row in rows
    ]
    assert {row.parent for row in rows} == {"scripted"}
    assert {row.client_id for row in rows} == {"scripted"}


def test_a_parent_who_errs_and_skips(db: Database, raising: None) -> None:
    run = begin(db)
    found = json.loads(answer("--limit", "6", "--parent", "adversarial+skipping:0.5", "--json").stdout)
    rows = [row.answer for row in every(db, run)]
    assert found["skipped"] == sum(row.choice == "skip" for row in rows) > 0
    assert found["answered"] == sum(row.choice != "skip" for row in rows) == 6
    assert {row.parent for row in rows} == {"scripted"}


def test_a_parent_that_is_none() -> None:
    said = answer("--parent", "nosy")
    assert said.exit_code == 2
    assert "--parent: There is no parent 'nosy'. Did you mean 'noisy'?" in said.stderr


@pytest.mark.slow
def test_optimal(db: Database, raising: None) -> None:
    run = begin(db)
    found = json.loads(answer("--json").stdout)
    assert (found["run"], found["ended"], found["sentence"]) == (
        1,
        "optimal",
        "Its argmax policy is optimal.",
    )
    assert runs.get_run(db, run).optimal
    assert found["answered"] == sum(found["choices"].values()) == runs.get_run(db, run).answers > 0


def test_a_goal(db: Database, raising: None) -> None:
    begin(db, "reward-hacking", goal=5)
    said = answer("--client-id", "nightly")
    assert said.exit_code == 0
    assert "answered 5 (" in said.stdout
    assert said.stdout.endswith("The run rests at its goal of 5 answers.\n")


def test_a_run_that_is_over(db: Database, web: httpx2.Client) -> None:
    for run, status in enumerate(OVER, start=1):
        begin(db)
        if status is RunStatus.STOPPED:
            runs.set_status(db, run, status)
        else:
            (mine,) = runs.claim(db, "test", -1)
            runs.finish(db, mine, status, "The disk is full.")
    assert (answer().exit_code, answer().stdout) == (0, "Run 1: answered 0. The run is stopped.\n")
    assert answer(run=2).exit_code == 0
    said = answer(run=3)
    assert (said.exit_code, said.stdout) == (1, "Run 3: answered 0. The run failed: The disk is full.\n")


@pytest.mark.slow
def test_the_timeout_ends_and_says_who_waits_for_whom(db: Database, web: httpx2.Client) -> None:
    begin(db)
    said = answer("--timeout", "0.3")
    assert said.exit_code == 1
    assert (
        "No worker raises run 1. Start one: `parenting worker`. Nothing was asked for 0.3 s.\n" in said.stdout
    )
    runs.set_status(db, 1, RunStatus.PAUSED)
    assert "Run 1 is paused: resume it on its page." in answer("--timeout", "0.3").stdout
    runs.set_status(db, 1, RunStatus.ACTIVE)
    (query,) = asked(db, 1, 1)
    leases.lease(db, 1, "somebody")
    assert "Somebody else holds the questions of run 1." in answer("--timeout", "0.3").stdout
    answers.answer(db, query, "left", "somebody", "human")
    assert "The agent of run 1 explores, at tick 0." in answer("--timeout", "0.3").stdout


def test_ctrl_c(db: Database, web: httpx2.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    begin(db)
    asked(db, 1, 1)
    monkeypatch.setattr("parenting.commands.judge.Judge.choice", _interrupt)
    said = answer()
    assert (said.exit_code, said.stdout) == (130, "Run 1: answered 0. Stopped.\n")


def _interrupt(*_: object) -> str:
    raise KeyboardInterrupt


@pytest.mark.slow
def test_without_leave_to_end_episodes_it_says_so(db: Database, web: httpx2.Client) -> None:
    begin(db)
    (mine,) = runs.claim(db, "test", -1)
    report_progress(db, mine, tick=7, waiting="stuck")
    said = answer()
    assert said.exit_code == 1
    assert "No action was acceptable at tick 7, so the agent stands still. End the episode on " in said.stdout
    assert not operator_events.list_operator_events(db, 1)
    found = json.loads(answer("--end-episodes", "--timeout", "0.3", "--json").stdout)
    assert (found["episodes_ended"], found["ended"]) == (1, "silent")
    assert [event.kind for event in operator_events.list_operator_events(db, 1)] == ["end_episode"]


# What is wrong


def test_wrong_runs(db: Database, web: httpx2.Client) -> None:
    said = answer(run=7)
    assert (said.exit_code, said.stdout) == (2, "")
    assert said.stderr == "--run: There is no run 7. On the server's machine `parenting runs` lists them.\n"
    begin(db, parent="scripted")
    said = answer()
    assert said.exit_code == 2
    assert said.stderr.startswith("--run: the worker itself answers run 1, since")
    begin(db, "reward-hacking")
    said = answer("--until", "optimal", run=2)
    assert said.exit_code == 2
    assert said.stderr.startswith("--until: no policy counts as optimal in reward-hacking")


@pytest.mark.parametrize("token", ["geheim\nb", "geheim ", "geheim\x07", "geheim\u20ac", "geheim\udcff"])
def test_a_token_that_no_header_holds_is_not_printed(token: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARENTING_TOKEN", token)
    for more in ([], ["--people", "2"]):
        said = CliRunner().invoke(app, ["answer", "--url", f"http://localhost:{free_port()}", *more])
        assert (said.exit_code, said.stdout) == (2, "")
        assert said.stderr.startswith("PARENTING_TOKEN: it holds a blank, a line end or another character")
        assert "geheim" not in said.stderr


def test_a_name_that_the_server_does_not_go_by(db: Database, web: httpx2.Client) -> None:
    begin(db)
    said = answer("--url", "http://elsewhere.example")
    assert said.exit_code == 2
    assert said.stderr == "--url: This server does not answer under this name.\n"


def test_wrong_names_and_files(db: Database, web: httpx2.Client, tmp_path: Path) -> None:
    begin(db)
    said = answer("--client-id", "a b")
    assert (said.exit_code, said.stderr.partition(":")[0]) == (2, "client_id")
    said = answer("--receipts", str(tmp_path / "no" / "folder"))
    assert said.exit_code == 2
    assert said.stderr.endswith("folder cannot be written: No such file or directory.\n")


@pytest.mark.parametrize("url", ["localhost:8765", "ftp://localhost", "http://", "http://local host:x"])
def test_wrong_addresses(url: str) -> None:
    said = answer("--url", url)
    assert said.exit_code == 2
    assert said.stderr.startswith(f"--url: {url} ")
    assert said.stderr.endswith("Write it as http://localhost:8765; `parenting up` says which it is.\n")


@pytest.mark.slow_after(1)
@pytest.mark.parametrize(("status", "body"), [(200, b"<p>Hello"), (404, b"{}"), (200, b"[]"), (301, b"")])
def test_another_server(status: int, body: bytes) -> None:
    class Other(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(status)
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            """Nothing."""

    with HTTPServer(("127.0.0.1", 0), Other) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        url = f"http://127.0.0.1:{server.server_port}"
        said = answer("--url", f"{url}/")
        server.shutdown()
    assert said.exit_code == 2
    assert said.stderr.startswith(
        f"--url: {url} is not a server of Parenting: it answers {status} at /api/v1/runs/1. "
    )


@pytest.mark.slow
def test_no_server_is_told_by_the_process_without_a_trace(tmp_path: Path) -> None:
    url = f"http://127.0.0.1:{free_port()}"
    with parenting("answer", "--run", "1", "--url", url, data=tmp_path) as child:
        out, said = child.communicate(timeout=60)
    assert (child.returncode, out) == (2, "")
    assert said.startswith(f"--url: No server answers at {url} (")
    assert said.endswith("). Start one with `parenting up`, or name another.\n")
    assert said.count("\n") == 1
