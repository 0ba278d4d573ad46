"""`parenting worker --check`: what a container's health check asks."""

import socket
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from parenting.commands.main import app
from parenting.server.db import Database, connect
from parenting.server.migrate import upgrade
from parenting.server.settings import Settings
from parenting.server.store.clock import boot_mark
from parenting.server.workers import sign, sign_off
from tests.tree import ROOT

HERE = f"{socket.gethostname()}:7"


def check() -> Result:
    return CliRunner().invoke(app, ["worker", "--check"])


@pytest.fixture
def empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Database]:
    """The database of the command, without tables."""
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path))
    monkeypatch.delenv("PARENTING_DATABASE_URL", raising=False)
    database = connect(Settings(data=tmp_path, database_url=None))
    yield database
    database.close()


@pytest.fixture
def db(empty: Database) -> Database:
    upgrade(empty)
    return empty


def test_a_worker_that_lives_is_named(db: Database) -> None:
    sign(db, HERE)
    assert (check().exit_code, check().output) == (0, f"Alive: {HERE}\n")


def test_no_worker_is_told_in_a_sentence(db: Database) -> None:
    said = check()
    assert said.exit_code == 1
    assert said.stderr == (
        "No worker of this machine has given a sign of life for 10 s. Start one: `parenting worker`\n"
    )
    assert said.stdout == ""


def test_a_worker_that_ended_in_order_does_not_count(db: Database) -> None:
    sign(db, HERE)
    sign_off(db, HERE)
    assert check().exit_code == 1


def test_a_worker_that_fell_silent_does_not_count(db: Database) -> None:
    now = boot_mark()
    db.mark = lambda _session: now._replace(seconds=now.seconds - 11)
    sign(db, HERE)
    assert check().exit_code == 1


def test_workers_of_other_machines_do_not_count(db: Database) -> None:
    """So with two containers each says what its own worker does."""
    sign(db, "elsewhere:7")
    sign(db, f"not-{HERE}")
    assert check().exit_code == 1


def test_there_is_no_database(empty: Database, tmp_path: Path) -> None:
    said = check()
    assert said.exit_code == 2
    assert said.stderr.startswith(f"There is no database at {tmp_path / 'parenting.db'}. Set PARENTING_DATA")
    assert not (tmp_path / "parenting.db").exists()


def test_tables_are_missing(empty: Database, tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / "parenting.db")) as connection:
        connection.execute("CREATE TABLE another (number INTEGER)")
    said = check()
    assert said.exit_code == 2
    assert said.stderr.endswith("has no tables yet. Run: `parenting migrate`\n")


@pytest.mark.slow
def test_the_check_loads_no_torch() -> None:
    """It is asked once a minute."""
    code = "import sys, commands.worker; assert 'torch' not in sys.modules"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
