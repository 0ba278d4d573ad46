"""Exports of whole runs: one schema for all worlds, hashed, of one moment, whole or not at all."""

from __future__ import annotations

import csv
import hashlib
import io
import json
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest

from parenting.envs import registry
from parenting.server.archive import manifest, rows, writing
from parenting.server.archive.answer_columns import ANSWERS, AnswerRow
from parenting.server.archive.log_columns import EVENTS, FIGURES, METRICS, EventRow, MetricRow
from parenting.server.archive.question_columns import QUESTIONS, QuestionRow
from parenting.server.archive.target import target
from parenting.server.archive.writing import write_export
from parenting.server.compact import METRICS as STORED
from parenting.server.db import Database
from parenting.server.errors import NotFound, SetupError
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import claim, get_run, let_go
from parenting.server.spreadsheet import cell
from parenting.server.tables import Query
from tests.server.conftest import CLIPS


@pytest.fixture
def folder(db: Database, five: list[int], tmp_path: Path) -> Path:
    with target(tmp_path / "out") as files:
        write_export(db, five, files)
    return tmp_path / "out"


def lines(folder: Path, name: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / name).read_text().splitlines()]


def cells(folder: Path, name: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO((folder / name).read_text())))


def test_the_manifest_names_every_file(folder: Path) -> None:
    told = manifest.Manifest.model_validate_json((folder / "manifest.json").read_bytes())
    files = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    assert set(told.files) | {"manifest.json"} == files
    for name, entry in told.files.items():
        blob = (folder / name).read_bytes()
        assert (entry.sha256, entry.bytes) == (hashlib.sha256(blob).hexdigest(), len(blob))
    assert told.files["answers.jsonl"].rows == 26
    assert [run.counts.in_x for run in told.runs] == [4] * 5
    assert {run.settings["world"] for run in told.runs} == set(registry.WORLDS)


@pytest.mark.slow
def test_an_answer_tells_what_supersedes_it_and_whether_it_is_in_x(folder: Path, db: Database) -> None:
    mine = [row for row in lines(folder, "answers.jsonl") if row["run"] == get_run(db, 1).public_id]
    told = [
        (row["number"], row["choice"], row["standing"], row["supersedes"], row["superseded_by"], row["in_x"])
        for row in mine
    ]
    assert told[3:] == [
        (4, "neither", True, None, None, False),
        (5, "left", False, None, 6, True),  # the correction was not heard yet
        (6, "right", True, 5, None, False),
    ]
    assert [row["applied_tick"] for row in mine] == [2, 4, 6, 8, 10, None]
    assert (mine[0]["after_1_down"], mine[0]["before_up"]) == (0.2, None)
    assert len({row["pseudonym"] for row in mine}) == 2
    assert "tab 0" not in (folder / "answers.jsonl").read_text()


def test_questions_tell_why_and_those_without_an_answer_are_there(folder: Path) -> None:
    first, *_ = asked = lines(folder, "questions.jsonl")
    assert {side: first[side] for side in ("left", "right")} == CLIPS
    assert (first["why_pausing"], first["why_draw"], first["policy_right"]) == (True, 0.2, 0.4)
    assert sorted(row["status"] for row in asked) == ["applied"] * 25 + ["open"]


FORMS: dict[str, tuple[Any, Any]] = {
    "answers.jsonl": (ANSWERS, AnswerRow),
    "questions.jsonl": (QUESTIONS, QuestionRow),
    "answers.csv": (ANSWERS, AnswerRow),
    "events.csv": (EVENTS, EventRow),
    "metrics.csv": (METRICS, MetricRow),
}


def test_every_row_has_every_column(folder: Path) -> None:
    book = (folder / "codebook.md").read_text()
    for name, (columns, model) in FORMS.items():
        names = [column.name for column in columns]
        found: list[dict[str, Any]] = cells(folder, name) if name.endswith(".csv") else lines(folder, name)
        assert len(names) == len(set(names))
        assert found
        assert all(list(row) == names for row in found)
        assert all(f"| `{one}` |" in book for one in names)
        if name.endswith(".jsonl"):
            for row in found:
                model.model_validate_json(json.dumps(row))


def test_csv_holds_what_the_lines_hold(folder: Path) -> None:
    told = [{name: cell(value) for name, value in row.items()} for row in lines(folder, "answers.jsonl")]
    assert cells(folder, "answers.csv") == told


def test_parquet_holds_what_the_lines_hold(folder: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    assert parquet.read_table(folder / "answers.parquet").to_pylist() == lines(folder, "answers.jsonl")


def test_metrics_of_other_names_are_kept(folder: Path) -> None:
    first, second, *_ = cells(folder, "metrics.csv")
    assert (first["size"], first["loss"], first["more"]) == ("1", "", "")
    assert (second["size"], json.loads(second["more"])) == ("3", {"new": 0.5})
    assert set(STORED) <= {column.name for column in FIGURES}


def test_without_pyarrow_it_says_what_it_left_out(
    db: Database, five: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writing, "parquet_installed", lambda: False)
    with target(tmp_path / "out.zip") as files:
        told = write_export(db, [1], files)
    with ZipFile(tmp_path / "out.zip") as zipped:
        assert "answers.parquet" not in zipped.namelist()
    assert [left["file"] for left in told["left_out"]] == ["answers.parquet"]


def test_it_is_of_one_moment(
    db: Database, five: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No table holds what is asked and answered while it is written."""
    monkeypatch.setattr(rows, "BATCH", 2)
    went_on: list[int] = []

    def go_on(done: int, total: int) -> None:
        if not went_on:
            went_on.append(done)
            let_go(db, claim(db, "other", -1))
            (mine,) = (one for one in claim(db, "again", -1) if one.run_id == 2)
            answer(db, post_query(db, mine, 99, "guidance", 1, CLIPS), "left", "late", "human")

    with target(tmp_path / "out") as files:
        told = write_export(db, [2], files, go_on)
    assert went_on
    assert len(lines(tmp_path / "out", "answers.jsonl")) == told["runs"][0]["counts"]["answers"] == 5
    assert len(lines(tmp_path / "out", "questions.jsonl")) == 5


def test_a_damaged_row_stands_there_and_says_so(db: Database, five: list[int], tmp_path: Path) -> None:
    with db.write() as session:
        session.get_one(Query, 1).clips = {"left": "nothing"}
    with target(tmp_path / "out") as files:
        write_export(db, [1], files)
    asked, said = lines(tmp_path / "out", "questions.jsonl"), lines(tmp_path / "out", "answers.jsonl")
    assert (asked[0]["left"], asked[0]["tick"]) == (None, 1)
    assert "query.clips" in asked[0]["damaged"]
    assert ["query.clips" in (row["damaged"] or "") for row in said[:2]] == [True, False]


@pytest.mark.parametrize("name", ["out", "out.zip"])
def test_nothing_half_done_stays(db: Database, five: list[int], tmp_path: Path, name: str) -> None:
    (tmp_path / f".{name}.999999999.part").mkdir()  # of a process that was killed
    with pytest.raises(NotFound), target(tmp_path / name) as files:
        write_export(db, [1, 99], files)
    assert not list(tmp_path.glob(f"*{name}*"))
    with target(tmp_path / name) as files:
        write_export(db, [1], files)
    with pytest.raises(SetupError, match="exists already"), target(tmp_path / name):
        pass
    with target(tmp_path / name, force=True) as files:
        write_export(db, [2], files)
    assert [path.name for path in tmp_path.glob(f"*{name}*")] == [name]


def test_what_is_no_export_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").touch()
    with pytest.raises(SetupError, match="something else"), target(tmp_path / "mine", force=True):
        pass
    assert (tmp_path / "mine" / "thesis.tex").exists()
