"""A run begins with the answers of an export of whole runs as with those of one table."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from parenting.server.archive.target import target
from parenting.server.archive.writing import write_export
from parenting.server.db import Database
from parenting.server.export import lines
from parenting.weights.origin import UnreadableOriginError, read_origin
from tests.server.archive.test_import_of_runs import change

pytestmark = pytest.mark.only("sqlite", "the files are the same from every store")


def export(db: Database, numbers: list[int], path: Path) -> Path:
    with target(path) as files:
        write_export(db, numbers, files)
    return path


def test_both_formats_hold_the_same_answers(db: Database, five: list[int], tmp_path: Path) -> None:
    table = tmp_path / "run-1.jsonl"
    table.write_text("".join(lines(db, 1)))
    first = read_origin(None, table).answers
    assert first is not None
    assert len(first.rows) == 5
    for name in ("run-1", "run-1.zip"):
        assert read_origin(None, export(db, [1], tmp_path / name)).answers == first
    folder = tmp_path / "run-1"
    for name in ("answers.jsonl", "questions.jsonl"):
        change(folder, name, lambda blob: blob + b"\n\n")
    assert read_origin(None, folder).answers == first


def test_what_is_no_export_of_one_run_is_refused(db: Database, five: list[int], tmp_path: Path) -> None:
    several, changed, foreign = (tmp_path / name for name in ("several.zip", "changed", "foreign"))
    export(db, [1, 2], several)
    answers = export(db, [1], changed) / "answers.jsonl"
    answers.write_text(answers.read_text().replace('"left"', '"right"'))
    foreign.mkdir()
    (foreign / "manifest.json").write_text(json.dumps({"format": "another"}))
    for path, told in (
        (several, "it holds 2 runs"),
        (changed, "answers.jsonl is not the file that was written"),
        (foreign, "it is an export of another format"),
    ):
        with pytest.raises(UnreadableOriginError, match=told) as refused:
            read_origin(None, path)
        assert refused.value.field == "from_answers"
