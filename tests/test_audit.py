"""The auditor of exports: it finds nothing in a sound one, and each sabotage of its files."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from parenting.audit import audit, files
from parenting.audit.checks import PER_RUN
from parenting.audit.store import begun

BEGIN = hashlib.sha256(b"parenting: the answers of a run, 1").hexdigest()
CHOICES = ("left", "right", "either", "neither", "left")
MU: dict[str, tuple[float | None, float | None]] = {
    "left": (1.0, 0.0),
    "right": (0.0, 1.0),
    "either": (0.5, 0.5),
    "neither": (None, None),
}
Rows = list[dict[str, Any]]


def said(number: int, choice: str, question: int, heard: int | None) -> dict[str, Any]:
    mu = MU[choice]
    return {
        "run": "R",
        "number": number,
        "question": f"q{question}",
        "kind": "guidance",
        "tick": 2 * question - 1,
        "choice": choice,
        "mu_left": mu[0],
        "mu_right": mu[1],
        "standing": True,
        "supersedes": None,
        "superseded_by": None,
        "applied_tick": heard,
        "in_x": choice != "neither",
        "erased": False,
        "digest": hashlib.sha256(str(number).encode()).hexdigest(),
    }


def sound() -> dict[str, Any]:
    """Five answers in a run; a sixth one corrects the fifth, and is heard in tick 12."""
    answers = [said(n, choice, n, 2 * n) for n, choice in enumerate(CHOICES, start=1)]
    answers.append({**said(6, "right", 5, 12), "supersedes": 5})
    answers[4] |= {"standing": False, "superseded_by": 6, "in_x": False}
    chain(answers)
    asked = {"run": "R", "kind": "guidance", "status": "applied"}
    counted: dict[str, Any] = {"run": "R", "preference": 0, "skips": 0, "more": '{"new": 0.5}'}
    metrics = [
        {"tick": 4, "size": 2, "guidance": 2, "left": 1, "right": 1, "either": 0, "neither": 0},
        {"tick": 11, "size": 4, "guidance": 5, "left": 2, "right": 1, "either": 1, "neither": 1},
        {"tick": 12, "size": 4, "guidance": 5, "left": 1, "right": 2, "either": 1, "neither": 1},
    ]
    return {
        "answers": answers,
        "questions": [{**asked, "question": f"q{n}", "tick": 2 * n - 1} for n in range(1, 6)],
        "metrics": [{**counted, **row} for row in metrics],
        "events": [{"run": "R", "number": 1, "kind": "change"}],
        "counts": {"answers": 6, "questions": 5, "metrics": 3, "events": 1, "in_x": 4},
        "last_link": answers[-1]["link"],
    }


def chain(answers: Rows) -> None:
    before = BEGIN
    for row in answers:
        before = row["link"] = hashlib.sha256(f"{before}\n{row['digest']}".encode()).hexdigest()


def cell(value: Any) -> str:
    return "" if value is None else value if isinstance(value, str) else json.dumps(value)


def table(rows: Rows) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(rows[0])
    writer.writerows([cell(value) for value in row.values()] for row in rows)
    return out.getvalue()


def write(folder: Path, whole: dict[str, Any]) -> None:
    """Write an export whose hashes are right, whatever its rows say."""
    files = {
        "answers.jsonl": "".join(json.dumps(row) + "\n" for row in whole["answers"]),
        "answers.csv": whole.get("csv") or table(whole["answers"]),
        "questions.jsonl": "".join(json.dumps(row) + "\n" for row in whole["questions"]),
        "metrics.csv": table(whole["metrics"]),
        "events.csv": table(whole["events"]),
    }
    for name, text in files.items():
        (folder / name).write_text(text)
    hashed = {
        name: {"sha256": hashlib.sha256(text.encode()).hexdigest(), "bytes": len(text.encode())}
        for name, text in files.items()
    }
    run = {"run": "R", "settings": {}, "counts": whole["counts"], "last_link": whole["last_link"]}
    told = {"format": "parenting-export", "version": 2, "runs": [run], "files": hashed}
    (folder / "manifest.json").write_text(json.dumps(told))


def answer(number: int, **values: Any) -> Callable[[dict[str, Any]], None]:
    return lambda whole: whole["answers"][number - 1].update(values)


def counted(**values: int) -> Callable[[dict[str, Any]], None]:
    return lambda whole: whole["counts"].update(values)


def circle(whole: dict[str, Any]) -> None:
    answer(5, supersedes=6, superseded_by=6)(whole)
    answer(6, supersedes=5, superseded_by=5)(whole)


def without(number: int) -> Callable[[dict[str, Any]], None]:
    def remove(whole: dict[str, Any]) -> None:
        del whole["answers"][number - 1]
        whole["counts"]["answers"] -= 1

    return remove


def again(whole: dict[str, Any]) -> None:
    whole["answers"].insert(1, dict(whole["answers"][0]))


def reordered(whole: dict[str, Any]) -> None:
    first, second = whole["answers"][0], whole["answers"][1]
    first["digest"], second["digest"] = second["digest"], first["digest"]


def other_csv(whole: dict[str, Any]) -> None:
    whole["csv"] = table(whole["answers"]).replace("neither", "either", 1)


def relinked(whole: dict[str, Any]) -> None:
    whole["answers"][0]["digest"] = "0" * 64
    chain(whole["answers"])


SABOTAGES: dict[str, tuple[Callable[[dict[str, Any]], None], str]] = {
    "an answer is gone": (without(3), "answer 3 of run R is missing"),
    "an answer stands twice": (again, "answer 1 stands twice"),
    "the last answer is gone": (without(6), "does not end with the link"),
    "answers have changed places": (reordered, "answer 1 of run R does not follow"),
    "the chain was made again": (relinked, "does not end with the link"),
    "a choice was changed": (answer(1, choice="right"), "answer 1 of run R has another mu"),
    "choice and mu were changed": (
        answer(1, choice="right", mu_left=0.0, mu_right=1.0),
        "tick 4: left is 1, and the answers make it 0",
    ),
    "a choice that there is not": (answer(1, choice="both", mu_left=None, mu_right=None), "has no choice"),
    "a mu was changed": (answer(3, mu_left=0.7), "answer 3 of run R has another mu"),
    "heard twice in a tick": (answer(2, applied_tick=2), "two answers of run R were heard in tick 2"),
    "heard before it was asked": (
        answer(2, applied_tick=3),
        "answer 2 of run R was heard before its question",
    ),
    "heard later": (answer(1, applied_tick=5), "tick 4: size is 2, and the answers make it 1"),
    "never heard": (answer(1, applied_tick=None), "question q1 of run R is applied, and no answer"),
    "a correction of a circle": (circle, "answer 5 of run R supersedes itself, a later one"),
    "a correction of itself": (answer(6, supersedes=6), "answer 6 of run R supersedes itself"),
    "a correction of another question": (answer(6, supersedes=4), "or one to another question"),
    "a correction that was heard first": (
        answer(5, applied_tick=13),
        "answer 6 of run R was heard before the one that it corrects",
    ),
    "two corrections of one": (answer(4, supersedes=3), "answer 4 of run R supersedes itself, a later one"),
    "both stand": (answer(5, standing=True), "two answers to a question of run R stand"),
    "superseded by another": (answer(5, superseded_by=4), "answer 5 of run R is not superseded by what"),
    "applied twice": (answer(5, in_x=True), "answer 5 of run R is wrongly in X"),
    "left out of X": (answer(1, in_x=False), "answer 1 of run R is wrongly in X, or wrongly not"),
    "of another question": (answer(1, question="q9"), "answer 1 of run R names no question"),
    "of another kind": (answer(1, kind="preference"), "tells another kind or tick"),
    "of another run": (answer(1, run="S"), "is of the run S, which the manifest does not name"),
    "two questions in a tick": (
        lambda w: w["questions"][1].update(tick=1),
        "two questions of run R have tick 1",
    ),
    "a question is open again": (
        lambda w: w["questions"][0].update(status="open"),
        "question q1 of run R is open",
    ),
    "a question is gone": (lambda w: w["questions"].pop(), "answer 5 of run R names no question"),
    "the size of X was changed": (
        lambda w: w["metrics"][2].update(size=5),
        "tick 12: size is 5, and the answers make it 4",
    ),
    "a row of metrics is gone": (lambda w: w["metrics"].pop(), "run R has 2 metrics"),
    "the log was shortened": (counted(events=2), "run R has 1 events, and its manifest counts 2"),
    "a count was changed": (counted(answers=7), "run R has 6 answers, and its manifest counts 7"),
    "X was counted again": (counted(in_x=5), "run R has 4 entries of X"),
    "the forms differ": (other_csv, "row 4 of answers.csv is not row 4 of answers.jsonl"),
}


def test_a_sound_export(tmp_path: Path) -> None:
    write(tmp_path, sound())
    found = audit(tmp_path)
    assert found.problems == []
    assert (found.runs, found.answers, found.files) == (1, 6, 5)
    assert found.manifest_sha256 == hashlib.sha256((tmp_path / "manifest.json").read_bytes()).hexdigest()


@pytest.mark.parametrize("sabotage", SABOTAGES)
def test_a_sabotage_is_found(tmp_path: Path, sabotage: str) -> None:
    """The saboteur has made all hashes of files again."""
    spoil, told = SABOTAGES[sabotage]
    whole = sound()
    spoil(whole)
    write(tmp_path, whole)
    found = audit(tmp_path)
    assert not found.sound
    assert any(told in one for one in found.problems), found


@pytest.mark.parametrize(
    "name", ["answers.jsonl", "questions.jsonl", "metrics.csv", "events.csv", "answers.csv"]
)
@pytest.mark.parametrize("how", ["changed", "missing", "not what it was", "not named"])
def test_a_file_is_held_against_its_hash(tmp_path: Path, name: str, how: str) -> None:
    write(tmp_path, sound())
    file = tmp_path / name
    if how == "missing":
        file.unlink()
    elif how == "not named":
        told = json.loads((manifest := tmp_path / "manifest.json").read_text())
        del told["files"][name]
        manifest.write_text(json.dumps(told))
    else:
        file.write_bytes(b"\xff\x00{" if how == "not what it was" else file.read_bytes() + b"\n")
    found = audit(tmp_path)
    assert any(name in one for one in found.problems), found


def test_where_every_row_is_wrong_a_few_sentences_say_so(tmp_path: Path) -> None:
    whole = sound()
    whole["csv"] = table(whole["answers"]).replace("guidance", "preference")
    write(tmp_path, whole)
    kind = "row {0} of answers.csv is not row {0} of answers.jsonl"
    told = [
        *(kind.format(number) for number in range(1, 6)),
        f"... and more of this kind: {kind.format('N')}",
    ]
    assert audit(tmp_path).problems == told


@pytest.mark.parametrize("piece", [1, 7, 2**20])
def test_packed_lines_are_unpacked_piece_by_piece(monkeypatch: pytest.MonkeyPatch, piece: int) -> None:
    monkeypatch.setattr(files, "PIECE", piece)
    lines = [b"left" * 50, b"", b"right", b"neither"]
    packed = zlib.compress(b"\n".join(lines) + b"\n")
    assert list(files.unpacked_lines(io.BytesIO(packed))) == lines
    assert list(files.unpacked_lines(io.BytesIO(zlib.compress(b"one\nlast")))) == [b"one", b"last"]
    with pytest.raises((ValueError, zlib.error)):
        list(files.unpacked_lines(io.BytesIO(packed[:-5])))


@pytest.mark.parametrize("text", [None, "{", "[]", '{"format": "parenting-export", "version": 3}'])
def test_what_is_not_an_export(tmp_path: Path, text: str | None) -> None:
    if text is not None:
        (tmp_path / "manifest.json").write_text(text)
    assert not audit(tmp_path).sound
    assert "cannot be read" in str(audit(tmp_path))
    assert "neither a folder nor a zip" in str(audit(tmp_path / "nowhere"))


@pytest.mark.parametrize("query", PER_RUN.values(), ids=PER_RUN)
def test_no_check_looks_through_a_run_for_each_of_its_rows(query: str) -> None:
    """A million answers would take it days; an index is there for each look."""
    plan = begun().execute(f"EXPLAIN QUERY PLAN {query}").fetchall()
    parents = {number: (parent, told) for number, parent, _, told in plan}
    inner = [told for parent, told in parents.values() if is_for_each_row(parents, parent)]
    assert plan
    assert not [told for _, told in parents.values() if told.endswith("(run=?)")]
    assert not [told for told in inner if told.startswith("SCAN")]


def is_for_each_row(parents: dict[int, tuple[int, str]], number: int) -> bool:
    """Return whether a part of a plan lies in a query that is asked for each row of another."""
    while number in parents:
        number, told = parents[number]
        if told.startswith("CORRELATED"):
            return True
    return False
