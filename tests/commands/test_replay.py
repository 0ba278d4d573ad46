"""`parenting replay`: a run raised by hand comes out with the same bits; a changed record is found."""

from __future__ import annotations

import json
import os
import pty
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import text
from typer.testing import CliRunner, Result

from parenting.commands.main import app
from parenting.server import operator_events
from parenting.server.app import create_app
from parenting.server.db import Database, connect
from parenting.server.settings import Settings
from tests.database import migrated
from tests.server.eventful_run import TICKS, raise_eventful_run
from tests.server.heard import heard_answers
from tests.tree import ROOT


@pytest.fixture(scope="module")
def raised(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data folder with one run that was raised by hand."""
    data = tmp_path_factory.mktemp("raised")
    settings = Settings(data=data, database_url=None)
    db = migrated(settings)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "parenting.server.checkpoint_pace.CHECKPOINT_SECONDS", 1e9
        )  # so that they are written where it says so alone
        with TestClient(create_app(settings, db), base_url="http://localhost") as web:
            assert raise_eventful_run(db, web) == 1
    db.close()
    return data


@pytest.fixture
def data(raised: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same, to be changed."""
    monkeypatch.delenv("PARENTING_DATABASE_URL", raising=False)
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path / "copy"))
    shutil.copytree(raised, tmp_path / "copy")
    return tmp_path / "copy"


@pytest.fixture
def db(data: Path) -> Iterator[Database]:
    database = connect(Settings(data=data, database_url=None))
    yield database
    database.close()


def replay(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["replay", "1", *arguments])


def sql(db: Database, statement: str, **values: object) -> int:
    with db.write() as session:
        found = session.connection().execute(text(statement), values)
        return found.rowcount


def test_equal_bit_for_bit(db: Database) -> None:
    said = replay()
    assert said.exit_code == 0, said.output
    heard, events = len(heard_answers(db, 1)), operator_events.list_operator_events(db, 1)
    assert {event.kind for event in events} == {"end_episode", "change", "mature"}
    counts = f"{TICKS} ticks, {heard} answers, {len(events)} events replayed."
    assert said.output == f"Run 1: {counts} Equal bit for bit.\n"
    asked = [row.query for row in heard_answers(db, 1)]
    assert {query.kind for query in asked} == {"guidance", "preference"}


@pytest.mark.slow
def test_it_changes_nothing(db: Database, data: Path) -> None:
    def rows() -> list[object]:
        with db.read() as session:
            tables = ("run", "query", "answer", "event", "checkpoint")
            return [session.connection().execute(text(f"SELECT * FROM {name}")).all() for name in tables]

    before = rows()
    assert replay().exit_code == 0
    assert rows() == before


@pytest.mark.slow
def test_as_json(data: Path) -> None:
    found = json.loads(replay("--json").stdout)
    assert (found["run"], found["equal"], found["differ"], found["parted"]) == (1, True, [], None)
    assert found["tick"] == found["checkpoint"] == TICKS


def another_choice(db: Database) -> None:
    taken = next(row for row in heard_answers(db, 1) if row.answer.choice == "left")
    assert sql(db, "UPDATE answer SET choice = 'right' WHERE id = :id", id=taken.answer.id)


def a_late_choice(db: Database) -> None:
    """The last answer that training took in: only bits can tell."""
    taken = [row for row in heard_answers(db, 1) if row.answer.choice in ("left", "right")][-1]
    other = {"left": "right", "right": "left"}[taken.answer.choice]
    assert sql(db, "UPDATE answer SET choice = :other WHERE id = :id", other=other, id=taken.answer.id)


def a_moved_event(db: Database) -> None:
    assert sql(db, "UPDATE event SET applied_tick = applied_tick + 2 WHERE id = (SELECT min(id) FROM event)")


def a_dropped_event(db: Database) -> None:
    assert sql(db, "DELETE FROM event WHERE kind = 'mature'")


def a_dropped_change(db: Database) -> None:
    assert sql(db, "DELETE FROM event WHERE json_extract(payload, '$.name') = 'p_train'")


def a_dropped_question(db: Database) -> None:
    """One that was withdrawn: no answer hangs on it."""
    assert sql(db, "DELETE FROM query WHERE status = 'withdrawn'")


def an_unreadable_question(db: Database) -> None:
    assert sql(db, "UPDATE query SET clips = '{}' WHERE tick = (SELECT max(tick) FROM query WHERE tick < 40)")


def an_answer_moved(db: Database) -> None:
    heard = [row.answer for row in heard_answers(db, 1) if row.query.kind == "guidance"]
    tick = heard[-1].applied_tick
    assert sql(db, "UPDATE answer SET applied_tick = :tick - 1 WHERE applied_tick = :tick", tick=tick)


TAMPERED: dict[Callable[[Database], None], str] = {
    another_choice: "At tick ",
    a_late_choice: "Not equal",
    a_moved_event: "At tick ",
    a_dropped_event: "At tick ",
    a_dropped_change: "Not equal",
    a_dropped_question: "the record has no question there.",
    an_unreadable_question: "cannot be read",
    an_answer_moved: "At tick ",
}


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("tamper", TAMPERED, ids=lambda tamper: tamper.__name__)
def test_a_changed_record_is_found(db: Database, tamper: Callable[[Database], None]) -> None:
    tamper(db)
    said = replay()
    assert said.exit_code == 1, said.output
    assert said.output.startswith("Run 1: ")
    assert "Not equal. " in said.output
    assert TAMPERED[tamper] in said.output


@pytest.mark.slow
def test_pieces_of_state_are_named(db: Database) -> None:
    """Each once, in words, however many tensors of it differ."""
    a_late_choice(db)
    said, found = replay(), json.loads(replay("--json").stdout)
    assert said.exit_code == 1
    named = said.output.partition(f" After tick {TICKS} these differ: ")[2].removesuffix(".\n").split(", ")
    assert {"dataset X", "the policy in training", "Adam's state"} <= set(named)
    assert len(set(named)) == len(named)
    assert (found["equal"], found["parted"]) == (False, None)
    assert {"x.mu", "learner.live", "learner.first", "learner.second"} <= set(found["differ"])


def test_of_two_checkpoints_the_intact_one_is_taken(db: Database) -> None:
    assert sql(db, "UPDATE checkpoint SET blob = x'00' WHERE tick = :tick", tick=TICKS)
    said = replay()
    assert (said.exit_code, said.output.split(",")[0]) == (0, "Run 1: 25 ticks")


def test_what_cannot_be_replayed_is_said_in_a_sentence(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("parenting.server.replay.versions", lambda: {"torch": "9.9", "threads": 1})
    said = replay()
    assert (said.exit_code, said.stdout) == (2, "")
    assert said.stderr.startswith("Run 1 was trained with torch ")
    assert "here are torch 9.9 and 1 thread, which give other bits. Install torch " in said.stderr
    sql(db, "UPDATE checkpoint SET blob = x'00'")
    assert "Every checkpoint of run 1 is damaged" in replay().stderr
    sql(db, "DELETE FROM checkpoint")
    assert replay().stderr.startswith("Run 1 has no checkpoint yet")
    assert replay().exit_code == 2
    said = CliRunner().invoke(app, ["replay", "7"])
    assert (said.exit_code, said.stderr) == (2, "There is no run 7.\n")


def test_ctrl_c_ends_it_cleanly(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("parenting.server.replay.world_of", interrupt)
    said = replay()
    assert (said.exit_code, said.stdout, said.stderr) == (130, "", "Stopped.\n")


@pytest.mark.faults
def test_a_bar_on_the_terminal_and_ctrl_c(data: Path) -> None:
    """Its standard error is a terminal; the key is pressed as soon as the bar is there."""
    ours, theirs = pty.openpty()
    command = [sys.executable, "-P", "-m", "parenting.commands.main", "replay", "1"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm"}
    with subprocess.Popen(command, cwd=data, env=environment, stdout=subprocess.PIPE, stderr=theirs) as child:
        os.close(theirs)
        said = os.read(ours, 4096)
        while b"ticks" not in said:
            said += os.read(ours, 4096)
        child.send_signal(signal.SIGINT)
        out, _ = child.communicate(timeout=30)
    with suppress(OSError):  # how a terminal says that its other end is closed
        while more := os.read(ours, 4096):
            said += more
    os.close(ours)
    assert (child.returncode, out) == (130, b"")
    assert b"Stopped." in said
    assert b"Traceback" not in said
