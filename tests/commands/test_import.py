"""`parenting import`: runs that are added, and what is refused in a sentence."""

from __future__ import annotations

import tarfile
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
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim, get_run, list_runs, set_status
from parenting.server.session import RunSession
from parenting.server.statuses import RunStatus
from tests.tree import ROOT


def imported(path: Path, *options: str) -> Result:
    return CliRunner().invoke(app, ["import", str(path), *options])


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
        ("run-1.jsonl", "Give those of its run, and it is lived again: --seed, --preset, --set"),
        ("notes.txt", "is neither a folder nor a zip of an export"),
    ],
)
def test_what_is_refused(db: Database, tmp_path: Path, name: str, told: str) -> None:
    if name != "nowhere":
        (tmp_path / name).write_text("{}")
    said = imported(tmp_path / name)
    assert (said.exit_code, said.stdout) == (2, "")
    assert told in said.stderr


def test_an_imported_run_that_lives_has_to_find_room(
    db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start(db, NewRun(world="unsafe-exploration"))
    with target(tmp_path / "out.zip") as files:
        write_export(db, [1], files)
    monkeypatch.setenv("PARENTING_RUNS", "1")
    refused = imported(tmp_path / "out.zip")
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert refused.stderr.startswith("1 runs live, and no more may: nothing was started.")
    set_status(db, 1, RunStatus.STOPPED)
    assert imported(tmp_path / "out.zip").exit_code == 0
    assert len(list_runs(db)) == 2


def test_one_table_is_a_run_again_with_its_settings(
    db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start(db, NewRun(world="unsafe-exploration", seed=7, config={"pretrain": False, "stages": 2}))
    (mine,) = claim(db, "worker", -1)
    session = RunSession(db, mine, get_run(db, 1), lambda: None)
    while session.ready(watch(db, [1])[1]):
        session.tick()
    answer(db, 1, "left", "me", "human")
    file, log = tmp_path / "run-1.jsonl", tmp_path / "log.jsonl"
    assert CliRunner().invoke(app, ["export", "1", "-o", str(file)]).exit_code == 0
    assert CliRunner().invoke(app, ["export", "1", "--of", "events", "-o", str(log)]).exit_code == 0
    given = ["--seed", "7", "--set", "stages=2", "--set", "pretrain=false", "--events", str(log)]
    said = imported(file, *given)
    assert (said.exit_code, said.stderr) == (0, "")
    assert said.stdout.startswith("Run 2 is imported with 1 answer. Its page: /runs/")
    assert (get_run(db, 2).seed, get_run(db, 2).config) == (7, get_run(db, 1).config)
    assert entries(db, kind=Kind.OPERATOR).rows[0].what == "import of a table of answers"
    for wrong, told in (
        (["--seed", "8", *given[2:]], "With these settings the agent asks a question of guidance at tick 1"),
        ([*given, "--preset", "wild"], "preset=wild: There is no such preset."),
        (["--seed", "7", "--level", "nowhere"], "--level: 'nowhere' is neither a level of"),
        ([*given[:-1], str(tmp_path / "none")], "none cannot be read: No such file or directory."),
    ):
        refused = imported(file, *wrong)
        assert (refused.exit_code, refused.stdout) == (2, "")
        assert told in refused.stderr
    monkeypatch.setenv("PARENTING_RUNS", "2")
    assert imported(file, *given).stderr.startswith("2 runs live, and no more may")
    assert len(list_runs(db)) == 2


def test_a_level_that_is_not_built_in_is_asked_for(db: Database, tmp_path: Path) -> None:
    file = tmp_path / "run-1.jsonl"
    with tarfile.open(ROOT / "tests/old/0.1.0/data.tar.xz") as archive:
        file.write_bytes(archive.extractfile("data/run-2.jsonl").read())  # type: ignore[union-attr]
    said = imported(file, "--seed", "1")
    assert (said.exit_code, said.stdout) == (2, "")
    assert said.stderr.startswith("The level level of the table is not built in: give its file by --level.")


def test_options_of_a_table_are_refused_for_whole_runs(db: Database, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    said = imported(tmp_path / "out", "--seed", "1")
    assert (said.exit_code, said.stdout) == (2, "")
    assert said.stderr.startswith("--seed is for one table of answers (.jsonl).")
