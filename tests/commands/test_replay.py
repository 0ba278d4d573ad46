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

import httpx2
import pytest
from fastapi.testclient import TestClient
from sqlalchemy import text
from typer.testing import CliRunner, Result

from commands.main import app
from server import mailbox, queue, record, runs
from server.app import create_app
from server.db import Database, connect
from server.life import Life
from server.schema import upgrade
from server.settings import Settings
from server.starting import start
from tests.server.raising import Begun
from tests.server.serving import parenting
from tests.tree import ROOT

CONFIG = {
    "stages": 3,
    "mature_every": 12,
    "time_limit": 12,
    "max_open_preferences": 3,
    "p_rec": 0.9,
    "p_pref": 0.9,
}
BY_HAND = Begun("unsafe-exploration", "island", CONFIG, seed=12)
TICKS = 90
CHOICES = ("left", "right", "either", "left", "neither", "right", "right")


class Hand:
    """A person at the browser and an operator at the dashboard, over HTTP; a worker that is killed once."""

    def __init__(self, db: Database, web: httpx2.Client) -> None:
        self.db, self.web = db, web
        self.run = start(db, BY_HAND.new("human")).id
        self.life = self.taken_up()
        self.late = 0  # preferences answered when others had been asked since
        self.said = 0

    def taken_up(self) -> Life:
        (mine,) = runs.claim(self.db, "worker", -1)
        return Life(self.db, mine, runs.get_run(self.db, self.run), lambda: None)

    def live_to(self, tick: int) -> None:
        """Answer nothing before the agent waits: so preferences are answered late."""
        while self.life.tick < tick:
            seen = mailbox.watch(self.db, [self.run])[self.run]
            if self.life.ready(seen):
                self.life.beat(seen)
            elif bool(self.life.saved.state.stuck):
                self.post(f"runs/{self.run}/end-episode")
            else:
                self.answer()

    def until_guidance_is_open(self) -> None:
        while not runs.open_counts(self.db, self.run).guidance:
            self.live_to(self.life.tick + 1)

    def answer(self) -> int:
        question = self.post(f"runs/{self.run}/queries/lease", client_id="tab").json()
        self.late += question["kind"] == "preference" and question["tick"] < self.life.tick
        self.said += 1
        choice = CHOICES[self.said % len(CHOICES)]
        self.post(f"queries/{question['id']}/answer", client_id="tab", choice=choice)
        return int(question["id"])

    def post(self, path: str, **body: str) -> httpx2.Response:
        reply = self.web.post(f"/api/v1/{path}", json=body or None)
        assert reply.is_success, reply.text
        return reply


def raise_by_hand(db: Database, web: httpx2.Client) -> int:
    """What can happen to a run, at odd moments."""
    hand = Hand(db, web)
    hand.live_to(9)
    runs.set_goal(db, hand.run, 1000)
    runs.set_pace(db, hand.run, 500.0)
    hand.until_guidance_is_open()
    hand.post(f"runs/{hand.run}/end-episode")  # while guidance is open
    hand.live_to(25)
    hand.life.save()
    record.add_event(db, hand.run, "change", {"kind": "change", "name": "p_pref", "value": 0.8})
    hand.live_to(33)
    hand.life = hand.taken_up()  # the worker was killed: eight ticks are lived again
    hand.until_guidance_is_open()
    query = hand.answer()
    hand.live_to(hand.life.tick + 3)
    assert queue.get_query(db, query).status == "applied"
    queue.correct(db, query, "either", "tab", "human")  # too late for the agent
    record.add_event(db, hand.run, "change", {"kind": "change", "name": "p_train", "value": 0.5})
    hand.live_to(50)
    hand.post(f"runs/{hand.run}/mature")
    hand.live_to(TICKS)
    hand.life.save()
    assert hand.late > 1
    assert int(hand.life.saved.state.maturity) == 3
    return hand.run


@pytest.fixture(scope="module")
def raised(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data folder with one run that was raised by hand."""
    data = tmp_path_factory.mktemp("raised")
    settings = Settings(data=data, database_url=None)
    db = connect(settings)
    upgrade(db)
    with TestClient(create_app(settings, db), base_url="http://localhost") as web:
        assert raise_by_hand(db, web) == 1
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
    heard, events = len(mailbox.record(db, 1)), record.list_events(db, 1)
    assert {event.kind for event in events} == {"end_episode", "change", "mature"}
    counts = f"{TICKS} ticks, {heard} answers, {len(events)} events re-lived."
    assert said.output == f"Run 1: {counts} Equal bit for bit.\n"
    asked = [row.query for row in mailbox.record(db, 1)]
    assert {query.kind for query in asked} == {"guidance", "preference"}


def test_it_changes_nothing(db: Database, data: Path) -> None:
    def rows() -> list[object]:
        with db.read() as session:
            tables = ("run", "query", "answer", "event", "checkpoint")
            return [session.connection().execute(text(f"SELECT * FROM {name}")).all() for name in tables]

    before = rows()
    assert replay().exit_code == 0
    assert rows() == before


def test_as_json(data: Path) -> None:
    found = json.loads(replay("--json").stdout)
    assert (found["run"], found["equal"], found["differ"], found["parted"]) == (1, True, [], None)
    assert found["tick"] == found["checkpoint"] == TICKS


def another_choice(db: Database) -> None:
    taken = next(row for row in mailbox.record(db, 1) if row.answer.choice == "left")
    assert sql(db, "UPDATE answer SET choice = 'right' WHERE id = :id", id=taken.answer.id)


def a_late_choice(db: Database) -> None:
    """The last answer that training took in: only bits can tell."""
    taken = [row for row in mailbox.record(db, 1) if row.answer.choice in ("left", "right")][-1]
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
    heard = [row.answer for row in mailbox.record(db, 1) if row.query.kind == "guidance"]
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


@pytest.mark.parametrize("tamper", TAMPERED, ids=lambda tamper: tamper.__name__)
def test_a_changed_record_is_found(db: Database, tamper: Callable[[Database], None]) -> None:
    tamper(db)
    said = replay()
    assert said.exit_code == 1, said.output
    assert said.output.startswith("Run 1: ")
    assert "Not equal. " in said.output
    assert TAMPERED[tamper] in said.output


def test_pieces_of_state_are_named(db: Database) -> None:
    """Each once, in words, however many tensors of it differ."""
    a_late_choice(db)
    said, found = replay(), json.loads(replay("--json").stdout)
    assert said.exit_code == 1
    assert f" After tick {TICKS} these differ: dataset X, the policy in training, Adam's state" in said.output
    assert (found["equal"], found["parted"]) == (False, None)
    assert {"x.mu", "learner.live", "learner.first", "learner.second"} <= set(found["differ"])


def test_of_two_checkpoints_the_intact_one_is_taken(db: Database) -> None:
    assert sql(db, "UPDATE checkpoint SET blob = x'00' WHERE tick = :tick", tick=TICKS)
    said = replay()
    assert (said.exit_code, said.output.split(",")[0]) == (0, "Run 1: 25 ticks")


def test_what_cannot_be_replayed_is_said_in_a_sentence(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("server.replay.versions", lambda: {"torch": "9.9", "threads": 1})
    said = replay()
    assert (said.exit_code, said.stdout) == (2, "")
    assert said.stderr.startswith("Run 1 was raised with torch ")
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

    monkeypatch.setattr("server.replay.birth", interrupt)
    said = replay()
    assert (said.exit_code, said.stdout, said.stderr) == (130, "", "Stopped.\n")


def test_as_a_process(data: Path) -> None:
    with parenting("replay", "1", data=data) as child:
        out, said = child.communicate(timeout=60)
    assert (child.returncode, said) == (0, "")
    assert out.endswith("re-lived. Equal bit for bit.\n")


def test_a_bar_on_the_terminal_and_ctrl_c(data: Path) -> None:
    """Its standard error is a terminal; the key is pressed as soon as the bar is there."""
    ours, theirs = pty.openpty()
    command = [sys.executable, "-P", "-m", "commands.main", "replay", "1"]
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
