"""Values and rows of an export that break a rule: file, row, field and remedy are said, and nothing stays."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from parenting.server.archive.importing import import_export
from parenting.server.db import Database
from tests.server.archive.test_import_of_runs import change, folder, other, refuse, settings, written

__all__ = ["folder", "other", "written"]


def lines(name: str, make: Callable[[list[dict[str, Any]]], Any]) -> Callable[[Path], None]:
    """Change the rows of a table of JSON lines."""

    def changed(blob: bytes) -> bytes:
        rows = [json.loads(line) for line in blob.splitlines()]
        make(rows)
        return b"".join(json.dumps(row).encode() + b"\n" for row in rows)

    return lambda folder: change(folder, name, changed)


def twice(folder: Path) -> None:
    """Name the first run a second time."""
    told = json.loads((folder / "manifest.json").read_bytes())
    told["runs"] *= 2
    (folder / "manifest.json").write_text(json.dumps(told))


def without(folder: Path, name: str) -> None:
    told = json.loads((folder / "manifest.json").read_bytes())
    del told["runs"][0]["settings"][name]
    (folder / "manifest.json").write_text(json.dumps(told))


ASKED, SAID = "questions.jsonl", "answers.jsonl"
DAMAGES: dict[str, tuple[Callable[[Path], Any], str]] = {
    "a long name": (lambda f: settings(f, name="x" * 101), "manifest.json: run 1: name: 'xxx"),
    "a name with a control character": (lambda f: settings(f, name="a\x07"), "U+0007 is not allowed here"),
    "a long tag": (lambda f: settings(f, tags=f",{'x' * 41},"), "run 1: tags: ',xxx"),
    "tags without commas": (lambda f: settings(f, tags="pilot"), "tags stand between commas"),
    "a description of much": (lambda f: settings(f, description="x" * 2001), "run 1: description: 'xxx"),
    "a day that is none": (
        lambda f: settings(f, created="2026-02-30T00:00:00.000000Z"),
        "run 1: created: '2026-02-30T00:00:00.000000Z': a time in UTC stands here, such as 2026-01-31T",
    ),
    "a time of no zone": (
        lambda f: settings(f, created="2026-02-03"),
        "created: '2026-02-03': a time in UTC",
    ),
    "a count below zero": (lambda f: settings(f, answers=-1), "run 1: answers: -1: a whole number from 0"),
    "a setting too few": (lambda f: without(f, "tags"), "run 1: tags: it is missing. Nothing was imported."),
    "a run twice": (twice, "another run of the manifest has this id"),
    "a time of a row": (
        lines(ASKED, lambda rows: rows[1].update(asked="yesterday")),
        "questions.jsonl: row 2: asked: 'yesterday': a time in UTC stands here",
    ),
    "a long pseudonym": (
        lines(SAID, lambda rows: rows[2].update(pseudonym="x" * 101)),
        "answers.jsonl: row 3: pseudonym: 'xxx",
    ),
    "a cell too few": (
        lines(SAID, lambda rows: rows[1].pop("received")),
        "answers.jsonl: row 2: received: it is missing. Nothing was imported. Take another copy",
    ),
    "a null": (
        lines(ASKED, lambda rows: rows[3].update(tick=None)),
        "questions.jsonl: row 4: tick: it is missing",
    ),
    "a kind of no question": (
        lines(ASKED, lambda rows: rows[0].update(kind="quiz")),
        "row 1: kind: 'quiz': one of these stands here: guidance, preference",
    ),
    "a clip of another length": (lines(ASKED, lambda rows: rows[0]["left"].update(length=9)), "row 1: left:"),
    "a question twice": (
        lines(ASKED, lambda rows: rows[2].update(question=rows[0]["question"])),
        "row 1 has the same one",
    ),
    "a tick twice": (
        lines(ASKED, lambda rows: rows[2].update(tick=1)),
        "questions.jsonl: row 3: tick: 1: row 1 has the same one. Nothing was imported.",
    ),
    "a number twice": (
        lines(SAID, lambda rows: rows[1].update(number=1)),
        "answers.jsonl: row 2: number: 1: row 1 has the same one",
    ),
    "two answers in a tick": (
        lines(SAID, lambda rows: rows[3].update(applied_tick=2)),
        "answers.jsonl: row 4: applied_tick: 2: row 1 has the same one",
    ),
    "an answer in place of none": (
        lines(SAID, lambda rows: rows[3].update(supersedes=9)),
        "answers.jsonl: row 4: supersedes: 9: no answer of this number comes before it",
    ),
    "a payload of no event": (
        lambda f: change(f, "events.csv", lambda b: b.replace(b"p_rec", b"p_what")),
        "events.csv: row 1: payload: ",
    ),
    "a payload that is broken": (
        lambda f: change(f, "events.csv", lambda b: b.replace(b'"{', b'"')),
        "events.csv: row 1: payload: ",
    ),
    "a cell too many": (
        lambda f: change(f, "events.csv", lambda b: b.rstrip() + b",more\n"),
        "events.csv: line 2: its cells are 9, the columns 8. Remove or add cells, or quote a cell",
    ),
    "a column twice": (
        lambda f: change(f, "events.csv", lambda b: b.replace(b"heard", b"kind", 1)),
        "events.csv: line 1: the column 'kind' stands there twice",
    ),
}


@pytest.mark.only("sqlite", "nothing of it depends on the store")
def test_blank_last_lines_are_skipped(folder: Path, other: Database) -> None:
    for name in ("answers.jsonl", "questions.jsonl", "events.csv"):
        change(folder, name, lambda blob: blob + b"\n \n" if blob.startswith(b"{") else blob + b"\n\n")
    assert len(import_export(other, folder)) == 5


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.only("sqlite", "nothing of it depends on the store")
def test_a_wrong_value_is_named_with_its_row(
    written: tuple[Path, Database],
    tmp_path: Path,
    damage: str,
) -> None:
    refuse(written, tmp_path, *DAMAGES[damage])
