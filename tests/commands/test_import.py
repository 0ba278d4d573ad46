"""`parenting import`: runs that are added, and what is refused in a sentence."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from parenting.commands.main import app
from parenting.server.archive.target import target
from parenting.server.archive.writing import write_export
from parenting.server.audit.entries import entries
from parenting.server.audit.table import Kind
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.runs import get_run


def imported(path: Path) -> Result:
    return CliRunner().invoke(app, ["import", str(path)])


def test_runs_are_added(db: Database, tmp_path: Path) -> None:
    start(db, NewRun(world="unsafe-exploration", name="first"))
    with target(tmp_path / "out.zip") as files:
        write_export(db, [1], files)
    said = imported(tmp_path / "out.zip")
    assert (said.exit_code, said.stderr) == (0, "")
    assert said.stdout.startswith("Run 2 is imported with 0 answers. Its page: /runs/")
    assert f"It was {get_run(db, 1).public_id}, which this database has or had." in said.stdout
    assert get_run(db, 2).name == "first"
    (row,) = entries(db, kind=Kind.OPERATOR).rows
    assert (row.what, row.run) == ("import", get_run(db, 2).public_id)
    assert row.who.startswith("command line (")


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("nowhere", "nowhere is not there.\n"),
        ("run-1.jsonl", "--from-answers"),
        ("notes.txt", "is neither a folder nor a zip of an export"),
    ],
)
def test_what_is_refused(db: Database, tmp_path: Path, name: str, told: str) -> None:
    if name != "nowhere":
        (tmp_path / name).write_text("{}")
    said = imported(tmp_path / name)
    assert (said.exit_code, said.stdout) == (2, "")
    assert told in said.stderr
