"""SQLite as it has to be set: durable, guarded, and locked from the first word of a write (A1, D2, D3)."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from sqlalchemy import Connection, event, select, text
from sqlalchemy.exc import IntegrityError, OperationalError

from parenting.server import db as database
from parenting.server.checkpoints import save_checkpoint
from parenting.server.db import Database, connect
from parenting.server.errors import BusyError, DiskFullError, SetupError
from parenting.server.operator_events import add_operator_event
from parenting.server.progress import report_progress
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.runs import Claim
from parenting.server.settings import Settings
from parenting.server.store import sqlite
from parenting.server.store.sqlite import sqlite_module
from parenting.server.tables import Answer, Query, Run
from tests.tree import ROOT

pytestmark = pytest.mark.only("sqlite", "the settings of SQLite itself")

NORMAL, FULL = 1, 2


def pragma(db: Database, name: str) -> object:
    with db.read() as session:
        return session.execute(text(f"PRAGMA {name}")).scalar()


@pytest.mark.parametrize(
    ("name", "value"),
    [("journal_mode", "wal"), ("synchronous", 2), ("foreign_keys", 1), ("busy_timeout", 5000)],
)
def test_every_connection_is_set_up(db: Database, name: str, value: object) -> None:
    assert pragma(db, name) == value
    with db.write() as session:
        assert session.execute(text(f"PRAGMA {name}")).scalar() == value


@pytest.mark.parametrize(
    ("verb", "level"),
    [
        (lambda db, mine, query: answer(db, query, "left", "a", "human"), FULL),
        (lambda db, mine, query: post_query(db, mine, 9, "guidance", 1, {}), FULL),
        (lambda db, mine, query: add_operator_event(db, mine.run_id, "end_episode", {}), FULL),
        (lambda db, mine, query: lease(db, mine.run_id, "a"), NORMAL),
        (lambda db, mine, query: take_answer(db, mine, 9), NORMAL),
        (lambda db, mine, query: report_progress(db, mine, tick=9), NORMAL),
        (lambda db, mine, query: save_checkpoint(db, mine, 9, b"state"), NORMAL),
    ],
)
def test_what_somebody_was_told_is_on_the_disk_at_once(
    db: Database, mine: Claim, guidance: int, verb: Callable[..., object], level: int
) -> None:
    """The rest is there with the next commit that is: one log holds them all in their order."""
    found: list[object] = []

    def look(connection: Connection) -> None:
        found.append(connection.exec_driver_sql("PRAGMA synchronous").scalar())

    event.listen(db.engine, "commit", look)
    verb(db, mine, guidance)
    assert found == [level]
    with db.write() as session:
        assert session.execute(text("PRAGMA synchronous")).scalar() == FULL, "the next write is durable again"


def test_foreign_keys_are_held(db: Database) -> None:
    with pytest.raises(IntegrityError, match="FOREIGN KEY"), db.write() as session:
        session.add(Query(run_id=5, tick=1, kind="guidance", maturity=1, clips={}, posted=db.clock()))


def test_writes_begin_immediately_and_reads_do_not(db: Database, run: Run) -> None:
    said: list[str] = []
    event.listen(db.engine, "checkout", lambda driver, *_: driver.set_trace_callback(said.append))
    with db.read() as session:
        session.get(Run, run.id)
    assert next(word for word in said if not word.startswith("PRAGMA")) == "BEGIN DEFERRED"
    said.clear()
    with db.write() as session:
        session.get(Run, run.id)
    assert next(word for word in said if not word.startswith("PRAGMA")) == "BEGIN IMMEDIATE"


def test_write_lock_is_held_before_the_first_statement(db: Database, settings: Settings, run: Run) -> None:
    """With a deferred BEGIN the second writer would get in, and one of both would fail at its first write."""
    other = connect(settings)
    order: list[str] = []

    def second() -> None:
        with other.write() as session:
            order.append("second")
            session.get_one(Run, run.id).name = "second"

    with db.write() as session:
        found = session.get_one(Run, run.id)
        thread = threading.Thread(target=second)
        thread.start()
        thread.join(0.2)
        order.append("first")
        found.name = "first"
    thread.join()
    assert order == ["first", "second"]
    other.close()


def test_database_that_stays_locked_is_busy(
    db: Database, settings: Settings, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sqlite.PRAGMAS, "busy_timeout", "50")
    other = connect(settings)
    with db.write(), pytest.raises(BusyError), other.write():
        pass
    monkeypatch.setattr(database, "BUSY_SECONDS", 0.05)
    with db.write(), pytest.raises(BusyError), db.write():
        pass
    other.close()


def test_full_disk_is_told_and_stores_no_half(db: Database, run: Run) -> None:
    def fill() -> None:
        with db.write() as session:
            pages = session.execute(text("PRAGMA page_count")).scalar_one()
            session.execute(text(f"PRAGMA max_page_count = {pages}"))
            session.get_one(Run, run.id).level_text = "W" * 10_000_000

    with pytest.raises(DiskFullError):
        fill()
    with db.read() as session:
        assert len(session.get_one(Run, run.id).level_text) < 1000


def test_other_faults_are_not_hidden(db: Database) -> None:
    with pytest.raises(OperationalError, match="no such table"), db.read() as session:
        session.execute(text("SELECT * FROM nowhere"))


def test_old_sqlite_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    old = SimpleNamespace(sqlite_version_info=(3, 51, 2), sqlite_version="3.51.2")
    monkeypatch.setattr("parenting.server.store.driver.importlib.import_module", lambda _name: old)
    with pytest.raises(SetupError, match=r"SQLite 3\.51\.2 can corrupt .* pip install 'pysqlite3>=0\.6\.1'"):
        sqlite_module()


@pytest.mark.parametrize("url", ["nonsense", "sqlite://", "sqlite:///:memory:", "oracle+nothing://x"])
def test_database_that_cannot_be_used_is_refused(url: str, tmp_path: Path) -> None:
    with pytest.raises(SetupError, match="PARENTING_DATABASE_URL"):
        connect(Settings(data=tmp_path, database_url=url))


def test_data_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(SetupError, match="PARENTING_DATA"):
        connect(Settings(data=tmp_path / "file" / "data", database_url=None))


KILLED = """
import sys
from pathlib import Path
from parenting.server.db import connect
from parenting.server.queue.worker_side import post_query
from parenting.server.queue.answers import answer
from parenting.server.runs import Claim
from parenting.server.settings import Settings
db = connect(Settings(data=Path(sys.argv[1]), database_url=None))
mine = Claim(1, "worker-1", 1)
for tick in range(100_000):
    query = post_query(db, mine, tick, "guidance", 1, {})
    print(answer(db, query, "left", "a", "human").number, flush=True)
"""


@pytest.mark.usefixtures("mine")
def test_answer_that_was_told_survives_sigkill(db: Database, settings: Settings) -> None:
    """The ledger is what the other process said after each commit; each line must be in the database."""
    last = 0
    for kill_after in (1, 7, 20):
        command = [
            sys.executable,
            "-c",
            KILLED.replace("range(", f"range({1000 * kill_after}, "),
            str(settings.data),
        ]
        child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)
        assert child.stdout is not None
        told = [int(child.stdout.readline()) for _ in range(kill_after)]
        os.kill(child.pid, signal.SIGKILL)
        told += [int(line) for line in child.communicate()[0].splitlines() if line.strip()]
        with db.read() as session:
            stored = set(session.scalars(select(Answer.number)))
        assert set(told) <= stored
        assert stored == set(range(1, max(stored) + 1)), "numbers have no gaps"
        assert max(told) > last
        last = max(told)
        assert pragma(db, "integrity_check") == "ok"


def test_answer_after_reopening(db: Database, settings: Settings, guidance: int) -> None:
    stored = answer(db, guidance, "left", "a", "human")
    db.close()
    again = connect(settings)
    assert answer(again, guidance, "left", "a", "human") == stored
    again.close()


def test_poll_looks_again_only_after_a_commit(db: Database, settings: Settings, run: Run) -> None:
    other, looks = connect(settings), []

    def look() -> int:
        looks.append(1)
        return len(looks)

    assert [db.cached("a", look) for _ in range(3)] == [1, 1, 1]
    for writer in (other, db):
        before = len(looks)
        with writer.write() as session:
            session.get_one(Run, run.id).tick += 1
            assert db.cached("a", look) == before, "not committed yet"
        assert [db.cached("a", look) for _ in range(2)] == [before + 1, before + 1]
    assert db.cached("b", look) == len(looks) == 4, "another question is not answered by the old look"
    other.close()


def test_commit_during_a_look_is_seen_by_the_next(db: Database, run: Run) -> None:
    def look() -> int:
        with db.read() as session:
            seen = session.get_one(Run, run.id).tick
        if not seen:
            with db.write() as session:
                session.get_one(Run, run.id).tick = 1
        return seen

    assert [db.cached("a", look) for _ in range(2)] == [0, 1]
