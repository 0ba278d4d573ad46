"""An export and an import whose process is killed (SIGKILL) leave nothing half done, and begin again cleanly.

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

from parenting.server.archive.importing import import_export
from parenting.server.archive.source import source
from parenting.server.archive.target import target
from parenting.server.archive.writing import write_export
from parenting.server.db import Database, connect
from parenting.server.settings import Settings
from parenting.server.tables import Answer, Query, Run
from tests.database import migrated
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


def end(code: str, data: Path, path: Path, row: int) -> int:
    """Run a process that kills itself at a row; return how it ended."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-c", code, str(data), str(path), str(row)], env=environment
    ).returncode


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
