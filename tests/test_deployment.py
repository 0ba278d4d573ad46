"""docs/deployment.md: its commands work, its unit is one, and it names what there is."""

import os
import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from parenting.server.app import create_app
from parenting.server.db import Database, connect
from parenting.server.migrate import require_current
from parenting.server.new_run import NewRun, start
from parenting.server.runs import list_runs, set_status
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from tests.database import migrated
from tests.services import read_compose
from tests.tree import ROOT

TEXT = (ROOT / "docs/deployment.md").read_text(encoding="utf-8")


@pytest.fixture
def db(tmp_path: Path) -> Iterator[Database]:
    """A data folder with two runs in its database."""
    database = migrated(Settings(data=tmp_path, database_url=None))
    for name in ("first", "second"):
        start(database, NewRun(world="unsafe-exploration", name=name))
    yield database
    database.close()


@contextmanager
def writing(db: Database) -> Iterator[None]:
    """Somebody else pauses and resumes a run meanwhile, as fast as he can."""
    done, wrote = threading.Event(), threading.Event()

    def write() -> None:
        while not done.is_set():
            for status in (RunStatus.PAUSED, RunStatus.ACTIVE):
                set_status(db, 1, status)
            wrote.set()

    writer = threading.Thread(target=write)
    writer.start()
    try:
        assert wrote.wait(30)
        yield
    finally:
        done.set()
        writer.join()


def documented(words: str, folder: Path, file: str) -> subprocess.CompletedProcess[str]:
    """Run the documented command that begins so, on the data in the folder, with another file."""
    (command,) = re.findall(rf"^ {{4}}({words} [^#\n]*?) +#", TEXT, re.MULTILINE)
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
    environment = {**os.environ, "PATH": path, "PYTHONPATH": str(ROOT), "PARENTING_DATA": str(folder)}
    command = command.replace("/media/disk/monday.db", file)
    return subprocess.run(["sh", "-c", command], cwd=folder, env=environment, capture_output=True, text=True)


@pytest.mark.slow
def test_its_commands_back_up_while_others_write_and_bring_it_back(db: Database, tmp_path: Path) -> None:
    with writing(db):
        done = documented("parenting backup", tmp_path, "monday.db")
    assert done.returncode == 0, done.stderr
    start(db, NewRun(world="unsafe-exploration", name="third"))
    refused = documented("parenting restore", tmp_path, "monday.db")
    assert (refused.returncode, "in use" in refused.stderr) == (2, True), refused.stderr
    db.close()
    done = documented("parenting restore", tmp_path, "monday.db")
    assert done.returncode == 0, done.stderr
    again = connect(Settings(data=tmp_path, database_url=None))
    require_current(again)
    assert [run.name for run in list_runs(again)] == ["second", "first"]
    again.close()


def test_the_unit_is_one(tmp_path: Path) -> None:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("this system has no systemd")
    (unit,) = re.findall(r"^```ini\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
    folder = Path(sys.executable).parent
    file = tmp_path / "parenting.service"
    file.write_text(unit.replace("/opt/parenting/bin", str(folder)))
    assert f"ExecStart={folder}/parenting up --no-browser\n" in file.read_text()
    done = subprocess.run(["systemd-analyze", "verify", str(file)], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_it_names_every_service_and_endpoint(db: Database, tmp_path: Path) -> None:
    app = create_app(Settings(data=tmp_path, database_url=None), db)
    endpoints = [path for path in app.openapi()["paths"] if not path.startswith("/api/")]
    assert len(endpoints) > 1
    names = [*read_compose()["services"], *endpoints]
    assert [name for name in names if f"\n| `{name}` |" not in TEXT] == []


def test_the_readme_leads_to_it() -> None:
    assert (
        "(docs/deployment.md)" in (ROOT / "README.md").read_text(encoding="utf-8").partition("## Read on")[2]
    )
