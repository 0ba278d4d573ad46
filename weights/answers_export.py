"""The answers of an export of whole runs (format 2), as lines of one table. No torch."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile, is_zipfile

from parenting.weights.answers_file import MOST_BYTES, AnswersFileError

MANIFEST, ANSWERS, QUESTIONS = "manifest.json", "answers.jsonl", "questions.jsonl"
OF_ANSWER = ("world", "kind", "maturity", "votes", "choice", "standing")
UNREADABLE = (BadZipFile, EOFError, KeyError, NotImplementedError, OSError, RuntimeError)
"""The errors of a file that is missing in a folder or a zip, or that cannot be read."""


def is_export(path: Path) -> bool:
    """Return whether this can be an export of whole runs: a folder or a zip."""
    return path.is_dir() or is_zipfile(path)


def lines_of(path: Path) -> bytes:
    """Return the answers of an export of one run, each with both clips of its question.

    Raises:
        AnswersFileError: it is not an export of one run, is damaged or too large.
    """
    try:
        if path.is_dir():
            return _joined({name: (path / name).read_bytes for name in (MANIFEST, ANSWERS, QUESTIONS)})
        with ZipFile(path) as zipped:
            return _joined({name: _reader(zipped, name) for name in (MANIFEST, ANSWERS, QUESTIONS)})
    except AnswersFileError:
        raise
    except (*UNREADABLE, TypeError, ValueError):
        raise AnswersFileError("it is not an export that `parenting export --out` has written") from None


def _reader(zipped: ZipFile, name: str) -> Any:
    return lambda: zipped.read(name)


def _joined(files: Mapping[str, Any]) -> bytes:
    told = json.loads(files[MANIFEST]())
    if told.get("format") != "parenting-export" or told.get("version") != 2:
        raise AnswersFileError("it is an export of another format than 2, or of something else")
    if len(told["runs"]) != 1:
        raise AnswersFileError(f"it holds {len(told['runs'])} runs; export one of them alone")
    asked = {row["question"]: row for row in _rows(files, told, QUESTIONS)}
    source = {"run_public_id": told["runs"][0]["run"], "database": told["database"]}
    found = (_line(row, asked, source) for row in _rows(files, told, ANSWERS))
    return "\n".join(map(json.dumps, found)).encode()


def _rows(files: Mapping[str, Any], told: dict[str, Any], name: str) -> Iterator[dict[str, Any]]:
    entry = told["files"][name]
    if entry["bytes"] > MOST_BYTES:
        raise AnswersFileError(f"{name} has {entry['bytes']} bytes, and {MOST_BYTES} are read at most")
    blob = files[name]()
    if hashlib.sha256(blob).hexdigest() != entry["sha256"]:
        raise AnswersFileError(f"{name} is not the file that was written: its hash differs")
    return map(json.loads, blob.rstrip().splitlines())


def _line(row: dict[str, Any], asked: Mapping[str, Any], source: dict[str, Any]) -> dict[str, Any]:
    """Return an answer as a line of one table; `damaged` stands there only where something is."""
    question = asked.get(row["question"]) or {"damaged": "its question is missing"}
    clips = {side: question.get(side) for side in ("left", "right")}
    wrong = row.get("damaged") or question.get("damaged")
    return source | {name: row[name] for name in OF_ANSWER} | clips | ({"damaged": wrong} if wrong else {})
