"""`parenting export`: the lines of `server.export`, whole or not at all."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from parenting.commands.main import app
from parenting.server.audit.entries import entries
from parenting.server.audit.table import Kind
from parenting.server.db import Database
from parenting.server.errors import DiskFullError
from parenting.server.export import lines
from parenting.server.new_run import NewRun, start
from parenting.server.queue.answers import answer
from parenting.server.queue.revisions import supersede
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import claim, get_run
from tests.server.conftest import CLIPS
from tests.server.serving import parenting


@pytest.fixture(autouse=True)
def answered(db: Database) -> None:
    """A run with three answers, one of them corrected, and a run without any."""
    for _ in range(2):
        start(db, NewRun(world="unsafe-exploration"))
    mine, _ = claim(db, "test")
    for tick in (1, 2, 3):
        query = post_query(db, mine, tick, "guidance", 1, CLIPS)
        answer(db, query, "left", "me", "human")
    supersede(db, query, "right", "me", "human")


def export(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["export", *arguments])


def test_to_standard_output(db: Database) -> None:
    said = export("1")
    assert (said.exit_code, said.stderr) == (0, "")
    assert said.stdout == "".join(lines(db, 1))
    assert [json.loads(line)["choice"] for line in said.stdout.splitlines()] == ["left"] * 3 + ["right"]


def test_the_audit_log_tells_who_exported_what(db: Database, tmp_path: Path) -> None:
    for given in (
        ["1"],
        ["2", "--of", "metrics", "--format", "csv"],
        ["1", "2", "-o", str(tmp_path / "a.zip")],
    ):
        assert export(*given).exit_code == 0
    assert export("99", "-o", str(tmp_path / "b")).exit_code == 2
    found = list(reversed(entries(db, kind=Kind.EXPORT).rows))
    names = {get_run(db, number).public_id: number for number in (1, 2)}
    assert [(row.what, names[row.run or ""]) for row in found] == [
        ("answers as jsonl", 1),
        ("metrics as csv", 2),
        ("the whole run as zip", 1),
        ("the whole run as zip", 2),
    ]
    assert all(row.who.startswith("command line (") for row in found)


def test_a_run_that_is_named_twice_is_one(db: Database, tmp_path: Path) -> None:
    assert export("2", "2", "-o", str(tmp_path / "study")).exit_code == 0
    assert export("2", "1", "2", "--of", "answers").exit_code == 2
    assert export("2", "2", "--of", "answers").exit_code == 0
    assert [row.what for row in entries(db, kind=Kind.EXPORT).rows] == [
        "answers as jsonl",
        "the whole run as folder",
    ]


def test_it_says_so_where_the_audit_log_takes_nothing(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("parenting.commands.audited.try_note_export", lambda *_: DiskFullError())
    said = export("1")
    assert (said.exit_code, said.stdout) == (0, "".join(lines(db, 1)))
    assert said.stderr.startswith("The audit log does not tell of this export: ")


def test_to_a_file(db: Database, tmp_path: Path) -> None:
    file = tmp_path / "run-1.jsonl"
    said = export("1", "-o", str(file))
    assert (said.exit_code, said.stdout) == (0, f"4 answers of run 1 written to {file}.\n")
    assert file.read_text() == "".join(lines(db, 1))
    assert list(tmp_path.glob(".*")) == []


def test_tables_and_other_parts(db: Database, tmp_path: Path) -> None:
    file = tmp_path / "run-1.csv"
    said = export("1", "--format", "csv", "-o", str(file))
    assert (said.exit_code, said.stdout) == (0, f"4 answers of run 1 written to {file}.\n")
    assert len(file.read_text().splitlines()) == 5
    assert export("1", "--of", "metrics").stdout == ""
    wrong = export("1", "--format", "xlsx")
    assert wrong.exit_code == 2
    assert all(part in wrong.stderr for part in ("--format", "xlsx", "jsonl", "csv"))


def test_a_run_without_answers(db: Database, tmp_path: Path) -> None:
    file = tmp_path / "none.jsonl"
    assert export("2", "--out", str(file)).stdout == f"0 answers of run 2 written to {file}.\n"
    assert file.read_text() == ""
    assert export("2").stdout == ""


def test_a_file_is_replaced_only_by_force(db: Database, tmp_path: Path) -> None:
    file = tmp_path / "mine.jsonl"
    file.write_text("precious")
    said = export("1", "-o", str(file))
    assert (said.exit_code, said.stdout) == (2, "")
    assert said.stderr.startswith(f"--out: {file} exists already.")
    assert file.read_text() == "precious"
    assert export("1", "-o", str(file), "--force").exit_code == 0
    assert file.read_text() == "".join(lines(db, 1))


@pytest.mark.parametrize(("error", "code"), [(KeyboardInterrupt, 130), (OSError(28, "No space left"), 2)])
def test_nothing_half_done_stays(
    db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException, code: int
) -> None:
    def breaking(db: Database, run: int, *_: object) -> Iterator[str]:
        yield "{}\n"
        raise error

    monkeypatch.setattr("parenting.commands.export_table.exported", breaking)
    (tmp_path / "old.jsonl").write_text("as it was")
    assert export("1", "-o", str(tmp_path / "old.jsonl"), "--force").exit_code == code
    assert export("1", "-o", str(tmp_path / "new.jsonl")).exit_code == code
    assert sorted(path.name for path in tmp_path.iterdir()) == ["data", "old.jsonl"]
    assert (tmp_path / "old.jsonl").read_text() == "as it was"


def test_what_is_wrong_is_said_in_a_sentence(db: Database, tmp_path: Path) -> None:
    assert (export("9").exit_code, export("9").stderr) == (2, "There is no run 9.\n")
    said = export("1", "-o", str(tmp_path / "no" / "folder.jsonl"))
    assert said.exit_code == 2
    assert said.stderr.endswith("folder.jsonl cannot be written: No such file or directory.\n")
    assert export("1", "-o", str(tmp_path), "--force").exit_code == 2


@pytest.mark.parametrize("command", [["export", "1"], ["replay", "1"], ["runs"]])
def test_no_database(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: list[str]) -> None:
    """It makes none either: a wrong folder is nothing to fill."""
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path / "nowhere"))
    said = CliRunner().invoke(app, command)
    assert (said.exit_code, said.stdout) == (2, "")
    assert said.stderr.startswith(f"There is no database at {tmp_path / 'nowhere' / 'parenting.db'}.")
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.parametrize("command", [["export", "1"], ["replay", "1"], ["runs"]])
def test_a_database_without_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: list[str]
) -> None:
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path))
    (tmp_path / "parenting.db").touch()
    said = CliRunner().invoke(app, command)
    assert (said.exit_code, said.stdout) == (2, "")
    assert said.stderr.endswith("has no tables yet. Run: `parenting migrate`\n")


@pytest.mark.slow
def test_a_reader_that_has_enough(db: Database, tmp_path: Path) -> None:
    """As in `parenting export 1 | head -1`."""
    (mine, *_) = claim(db, "test", -1)
    for tick in range(10, 200):
        answer(db, post_query(db, mine, tick, "guidance", 1, CLIPS), "left", "me", "human")
    with parenting("export", "1", data=tmp_path / "data") as child:
        assert child.stdout is not None
        assert json.loads(child.stdout.readline())["number"] == 1
        child.stdout.close()
        assert child.wait(30) == 1
        assert child.stderr is not None
        assert child.stderr.read() == ""


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("command", [["export", "1"], ["runs"]])
def test_it_loads_no_torch(db: Database, command: list[str]) -> None:
    code = f"from parenting.commands.main import app; import sys; app({command}, standalone_mode=False); "
    code += "sys.exit('torch' in sys.modules)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (found.returncode, found.stderr) == (0, "")
    assert found.stdout


def test_whole_runs(db: Database, tmp_path: Path) -> None:
    for place in (tmp_path / "study", tmp_path / "study.zip"):
        said = export("1", "2", "-o", str(place))
        assert (said.exit_code, said.stderr) == (0, "")
        assert said.stdout.startswith(f"4 answers, 3 questions, 0 events of runs 1, 2 written to {place}.\n")
        assert "SHA-256 of manifest.json: " in said.stdout
    assert len((tmp_path / "study" / "answers.jsonl").read_text().splitlines()) == 4


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ([], "Name a run"),
        (["1", "--format", "2"], "--out: name a new folder"),
        (["1", "2"], "One table is of one run"),
        (["1", "--of", "metrics", "--format", "2", "-o", "x"], "--of: one table has the format jsonl or csv"),
        (["1", "99", "-o", "new"], "There is no run 99"),
        (
            ["1", "--format", "csv", "-o", "a.zip"],
            "--out: a.zip ends with .zip, and one table as csv is asked",
        ),
        (["1", "--of", "metrics", "-o", "m.zip"], "--out: m.zip ends with .zip, and one table as jsonl is"),
        (["1", "--format", "csv", "-o", "a.jsonl"], "--out: a.jsonl ends with .jsonl, and one table as csv"),
        (["1", "--format", "2", "-o", "a.csv"], "--out: a.csv ends with .csv, and whole runs are asked for"),
        (["1", "-o", "a.parquet"], "--out: a.parquet ends with .parquet, and no such file is written. A"),
        (["1", "-o", "a.tar.gz"], "--out: a.tar.gz ends with .gz, and no such file is written."),
        (["1", "-o", "-"], "--out: - is not a name of a file. Leave --out out for standard output."),
    ],
)
def test_whole_runs_that_cannot_be_written(given: list[str], told: str) -> None:
    said = export(*given)
    assert (said.exit_code, said.stdout) == (2, "")
    assert said.stderr.startswith(told)


def test_an_export_is_checked(db: Database, tmp_path: Path) -> None:
    export("1", "-o", str(tmp_path / "out"))
    said = export("--check", str(tmp_path / "out"))
    assert (said.exit_code, said.stderr) == (0, "")
    assert "X are what the files make them" in said.stdout
    (tmp_path / "out" / "events.csv").write_text("")
    assert "events.csv is not the file that was written" in export("--check", str(tmp_path / "out")).stdout
    assert export("--check", str(tmp_path / "nowhere")).exit_code == 2
    assert export("1", "--check", str(tmp_path / "out")).exit_code == 2
