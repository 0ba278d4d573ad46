"""The doctor finds each fault, changes nothing, and never ends with a traceback."""

from __future__ import annotations

import os
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from sqlalchemy import text, update
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server.checkpoints import save_checkpoint
from parenting.server.db import Database, connect
from parenting.server.doctor import machine
from parenting.server.doctor.findings import Finding, guarded
from parenting.server.migrate import downgrade
from parenting.server.new_run import NewRun, start
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import claim
from parenting.server.settings import Settings
from parenting.server.store.sqlite import sqlite_module
from parenting.server.tables import Run
from parenting.server.workers import sign
from parenting.weights.store import SHIPPED, SUFFIX, digest
from tests.database import migrated
from tests.server.conftest import CLIPS
from tests.server.doctor.examined import examined, states


@pytest.fixture
def db(settings: Settings) -> Iterator[Database]:
    """A database with a run and a worker, in real time."""
    database = migrated(settings)
    start(database, NewRun(world="side-effects"))
    sign(database, "worker")
    yield database
    database.close()


def snapshot(folder: Path) -> dict[str, bytes]:
    """Every file but SQLite's shared memory, which holds locks alone."""
    files = [file for file in folder.rglob("*") if file.is_file() and not file.name.endswith("-shm")]
    return {str(file): file.read_bytes() for file in files}


def test_all_is_well_where_it_is_and_nothing_is_changed(settings: Settings, db: Database) -> None:
    os.chmod(settings.data / "parenting.db", 0o600)
    before = snapshot(settings.data)
    code, found = examined()
    assert (code, states(found)) == (0, {})
    assert snapshot(settings.data) == before
    expected = ["settings", "versions", "limits", "weights", "sqlite", "permissions", "file system", "space"]
    expected += ["backups", "database", "journal", "mark", "migrations", "clock", "worker", "stored weights"]
    expected += ["rows", "checkpoints"]
    assert list(found) == expected
    db.close()
    before = snapshot(settings.data)
    assert examined()[0] == 0
    assert snapshot(settings.data) == before


def test_for_people_it_is_a_line_each_with_a_remedy_behind_a_fault(settings: Settings) -> None:
    said = CliRunner().invoke(app, ["doctor"])
    assert said.exit_code == 2
    lines = said.stdout.splitlines()
    at = lines.index(f"error   database: there is none at {settings.data}/parenting.db")
    assert lines[at + 1].startswith("        -> parenting up makes one; parenting restore FILE")
    assert not settings.data.exists(), "it makes no folder"


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("SQLITE_NOTADB", "parenting restore FILE --replace"),
        ("SQLITE_CANTOPEN", "PARENTING_DATABASE_URL"),
        ("SQLITE_BUSY", "End the program that holds the database"),
        ("SQLITE_ERROR", "docs/operations.md explains"),
    ],
)
def test_what_cannot_be_examined_has_the_remedy_of_its_refusal(name: str, remedy: str) -> None:
    def look() -> list[Finding]:
        error = sqlite_module().DatabaseError("it says so")
        error.sqlite_errorname = name
        raise error

    (found,) = guarded("database", look)
    assert found.said == "It cannot be examined: DatabaseError: it says so"
    assert remedy in str(found.remedy)


@pytest.mark.parametrize("size", [0, 1, 100, 5_000, 60_000])
def test_a_damaged_file_is_an_error_with_the_way_to_a_backup(
    settings: Settings, db: Database, size: int
) -> None:
    db.close()
    os.truncate(settings.data / "parenting.db", size)
    code, found = examined()
    assert code == 2
    bad = found["database"] if found["database"]["state"] == "error" else found["migrations"]
    assert bad["state"] == "error"
    assert bad["remedy"]


def test_another_programs_lock_is_told(
    settings: Settings, db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.server.doctor.files.PATIENCE", 0.1)
    db.close()
    other = sqlite_module().connect(str(settings.data / "parenting.db"), isolation_level=None)
    other.execute("PRAGMA journal_mode=delete").fetchall()
    other.execute("PRAGMA locking_mode=exclusive").fetchall()
    other.execute("PRAGMA journal_mode=wal").fetchall()
    other.execute("BEGIN EXCLUSIVE")
    other.execute("CREATE TABLE more (x)")
    code, found = examined()
    other.close()
    assert code == 2
    assert found["database"]["state"] == "error"
    assert "lock" in found["database"]["said"]


def test_a_server_that_is_away_is_told_without_its_password(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARENTING_DATABASE_URL", "postgresql://me:p4ss@127.0.0.1:1/parenting")
    done = CliRunner().invoke(app, ["doctor"])
    assert done.exit_code == 2
    assert "cannot be reached" in done.stdout
    assert "p4ss" not in done.output


def test_older_and_newer_tables_are_told(settings: Settings, db: Database) -> None:
    downgrade(db, "0003")
    assert examined()[1]["migrations"]["remedy"] == "parenting migrate"
    with db.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    code, found = examined()
    assert code == 2
    assert "newer version" in found["migrations"]["said"]


def test_warnings_alone_end_with_1(settings: Settings, db: Database) -> None:
    os.chmod(settings.data, 0o755)
    with db.write() as session:
        session.execute(text("DELETE FROM worker"))
        session.execute(update(Run).values(created=datetime.now(UTC) + timedelta(hours=1)))
    code, found = examined()
    assert (code, states(found)) == (
        1,
        {"permissions": "warning", "clock": "warning", "worker": "warning"},
    )
    assert "in the future" in found["clock"]["said"]
    assert found["permissions"]["remedy"].startswith("chmod")


def test_weights_that_are_not_what_they_were_are_told(
    settings: Settings, db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with db.write() as session:
        session.execute(text("UPDATE weights SET blob = zeroblob(100)"))
    assert states(examined()[1]) == {"stored weights": "error"}
    with db.write() as session:
        session.execute(text("DELETE FROM weights"))
    assert "is missing" in examined()[1]["stored weights"]["said"]
    name = next(iter(machine.WEIGHTS))
    (tmp_path / f"{name}{SUFFIX}").write_bytes(b"damaged")
    monkeypatch.setattr(machine, "SHIPPED", tmp_path)
    said = examined()[1]["weights"]["said"]
    assert f"{name}{SUFFIX} is changed or damaged" in said
    assert said.count("is missing") == len(machine.WEIGHTS) - 1


def test_damaged_rows_are_named_with_their_runs_and_the_remedy(settings: Settings, db: Database) -> None:
    (mine,) = claim(db, "worker")
    for tick in range(12):
        post_query(db, mine, tick, "preference", 1, CLIPS)
    with db.write() as session:
        session.execute(text("UPDATE run SET config = '{\"stages\": []}'"))
        session.execute(text("UPDATE query SET clips = '{}' WHERE tick > 0"))
    code, found = examined()
    assert (code, states(found)) == (2, {"rows": "error"})
    said = found["rows"]["said"]
    assert said.startswith("run 1: its config, ")
    assert said.count("has not the shape that it was written with") == 10
    assert "question 2 of run 1 at tick 1: query.clips has not the shape" in said
    assert "tick 0" not in said
    assert said.endswith("and 2 more")
    assert "parenting restore FILE --replace" in found["rows"]["remedy"]


def test_a_damaged_checkpoint_is_named_and_costs_nothing(settings: Settings, db: Database) -> None:
    (mine,) = claim(db, "worker")
    for tick in (3, 4):
        save_checkpoint(db, mine, tick, bytes(100))
    with db.write() as session:
        session.execute(text("UPDATE checkpoint SET blob = zeroblob(99) WHERE tick = 4"))
    code, found = examined()
    assert (code, found["checkpoints"]["said"]) == (1, "damaged: run 1 at tick 4")


def test_every_shipped_file_has_its_checksum() -> None:
    files = {file.stem: digest(file.read_bytes()) for file in SHIPPED.glob(f"*{SUFFIX}")}
    assert files == machine.WEIGHTS


def test_little_space_few_files_and_an_old_sqlite_are_told(
    settings: Settings, db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Little:
        free = 1_000_000

    class Old:
        sqlite_version_info, sqlite_version, __name__ = (3, 40, 1), "3.40.1", "sqlite3"

    monkeypatch.setattr("parenting.server.doctor.files.shutil.disk_usage", lambda _: Little())
    monkeypatch.setattr("parenting.server.doctor.machine.resource.getrlimit", lambda _: (1024, 1024))
    found = examined()[1]
    assert (found["space"]["state"], found["limits"]["state"]) == ("error", "warning")
    monkeypatch.setattr("parenting.server.store.driver.importlib.import_module", lambda _: Old())
    found = examined()[1]
    assert "3.40.1 can corrupt a database" in found["sqlite"]["said"]
    assert found["database"]["state"] == "error"


@pytest.mark.parametrize(("flags", "remedy"), [(os.ST_RDONLY, "read-only"), (0, "chmod u+rwx ")])
def test_no_folder_is_given_to_whom_it_belongs_already(
    settings: Settings, db: Database, monkeypatch: pytest.MonkeyPatch, flags: int, remedy: str
) -> None:
    class Mounted:
        f_flag = flags

    monkeypatch.setattr("parenting.server.doctor.files.os.access", lambda *_: False)
    monkeypatch.setattr("parenting.server.doctor.files.os.statvfs", lambda _: Mounted())
    found = examined()[1]["permissions"]
    assert found["state"] == "error"
    assert remedy in found["remedy"]


def test_a_misspelt_setting_is_told(settings: Settings, db: Database) -> None:
    Path(".env").write_text("PARENTNG_DATA=elsewhere\n", encoding="utf-8")
    assert "Did you mean PARENTING_DATA?" in examined()[1]["settings"]["said"]


def test_a_table_that_is_gone_costs_its_own_line(settings: Settings, db: Database) -> None:
    with db.write() as session:
        session.execute(text("DROP TABLE worker"))
    found = examined()[1]
    assert states(found) == {"clock": "error", "worker": "error"}
    assert "no such table" in found["worker"]["said"]


def test_an_unmigrated_file_of_another_program_is_told(settings: Settings) -> None:
    connect(settings).close()
    with sqlite_module().connect(str(settings.data / "parenting.db")) as other:
        other.execute("CREATE TABLE notes (x)")
    other.close()
    assert examined()[1]["migrations"]["said"] == "the database has no tables yet"
