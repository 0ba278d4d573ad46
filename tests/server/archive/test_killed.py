"""An export, a check and an import that are killed (SIGKILL) leave nothing half done and begin again.

The process kills itself at a row, so no test waits for a moment.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from sqlalchemy import func, select

from parenting.audit import audit
from parenting.server.archive.importing import import_export
from parenting.server.archive.source import source
from parenting.server.archive.target import target
from parenting.server.archive.writing import write_export
from parenting.server.db import Database, connect
from parenting.server.settings import Settings
from parenting.server.tables import Answer, Query, Run
from tests.database import migrated
from tests.lengths import length
from tests.tree import ROOT

pytestmark = pytest.mark.only("sqlite", "PostgreSQL rolls back what a killed client began")
HEAD = """
import os, signal, sys
from pathlib import Path
from parenting.server.archive.importing import import_export
from parenting.server.archive.target import target
from parenting.server.archive.writing import write_export
from parenting.server.db import connect
from parenting.server.settings import Settings

def killed(done, total):
    if done >= int(sys.argv[3]):
        os.kill(os.getpid(), signal.SIGKILL)

db, path = connect(Settings(data=Path(sys.argv[1]), database_url=None)), Path(sys.argv[2])
"""
EXPORT = HEAD + "with target(path) as files: write_export(db, [1, 2, 3, 4, 5], files, killed)"
IMPORT = HEAD + "import_export(db, path, progress=killed)"

CHECK = """
import os, signal, sqlite3, sys
from contextlib import suppress
from pathlib import Path
from parenting.audit import audit

scratch, out, at, begin, passed = *sys.argv[1:3], int(sys.argv[3]), sqlite3.connect, []

def small(name):
    found = begin(name)  # a database that goes into its file at once
    found.execute("PRAGMA cache_size = 1").fetchall()
    found.set_trace_callback(seen)
    return found

def seen(statement):
    passed.append(statement)
    if len(passed) == at:
        names = []
        for one in os.listdir("/proc/self/fd"):
            with suppress(OSError):
                names.append(os.readlink(f"/proc/self/fd/{one}"))
        print(any(name.startswith(scratch) for name in names), flush=True)
        os.kill(os.getpid(), signal.SIGKILL)

sqlite3.connect = small
audit(Path(out))
print(len(passed))
"""
"""It kills itself at a statement of the auditor's database, and says whether the file was there."""


def end(code: str, data: Path, path: Path, row: int) -> int:
    """Run a process that kills itself at a row; return how it ended."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-c", code, str(data), str(path), str(row)], env=environment
    ).returncode


@pytest.mark.slow
@pytest.mark.parametrize("name", ["out", "out.zip"])
def test_an_export_that_was_killed_leaves_no_name_and_begins_again(
    db: Database, five: list[int], settings: Settings, tmp_path: Path, name: str
) -> None:
    place = tmp_path / "exports" / name
    place.parent.mkdir()
    assert end(EXPORT, settings.data, place, 40) == -signal.SIGKILL
    assert not place.exists()
    assert len(list(place.parent.iterdir())) == 1, "it was killed before its first row"
    with target(place) as files:
        write_export(db, five, files)
    assert [path.name for path in place.parent.iterdir()] == [name], "the hidden rest is removed"
    with source(place) as found:
        found.verify()
        assert len(found.manifest.runs) == 5


@pytest.mark.parametrize("at", length((30, 100), (30, 60, 80, 100, 110, 120, 128)))
@pytest.mark.torture
def test_a_check_that_was_killed_leaves_nothing_and_begins_again(
    db: Database, five: list[int], tmp_path: Path, at: int
) -> None:
    """Its database is a temporary file without a name, killed while it is filled and amid the checks."""
    out, scratch = tmp_path / "written" / "out.zip", tmp_path / "scratch"
    scratch.mkdir()
    out.parent.mkdir()
    with target(out) as files:
        write_export(db, five, files)
    before = out.read_bytes()
    environment = os.environ | {"PYTHONPATH": str(ROOT), "SQLITE_TMPDIR": str(scratch)}
    command = [sys.executable, "-c", CHECK, str(scratch), str(out), str(at)]
    killed = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert (killed.returncode, killed.stderr) == (-signal.SIGKILL, ""), killed.stdout
    assert killed.stdout == "True\n", "it had written nothing that could have been left"
    assert list(scratch.iterdir()) == []
    assert out.read_bytes() == before
    assert list(out.parent.iterdir()) == [out]
    assert audit(out).sound


def test_an_import_that_was_killed_has_added_nothing_and_begins_again(
    db: Database, five: list[int], tmp_path: Path
) -> None:
    with target(tmp_path / "out") as files:
        write_export(db, five, files)
    migrated(Settings(data=tmp_path / "other", database_url=None)).close()
    code = IMPORT.replace(
        "\ndb,", "\nfrom parenting.server.archive import import_record\nimport_record.AT_ONCE = 5\ndb,"
    )
    assert end(code, tmp_path / "other", tmp_path / "out", 40) == -signal.SIGKILL
    other = connect(Settings(data=tmp_path / "other", database_url=None))
    try:
        with other.read() as session:
            counts = [session.scalar(select(func.count()).select_from(one)) for one in (Run, Query, Answer)]
        assert counts == [0, 0, 0]
        assert [run.answers for run in import_export(other, tmp_path / "out")] == [6, 5, 5, 5, 5]
    finally:
        other.close()
