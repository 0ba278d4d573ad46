"""Imports: the same record, replayed to the same bits; what is damaged or foreign leaves nothing."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest
from sqlalchemy import func, select

from parenting.audit import audit
from parenting.server import chain, runs
from parenting.server.archive.importing import import_export
from parenting.server.archive.target import target
from parenting.server.archive.writing import write_export
from parenting.server.db import Database
from parenting.server.errors import SetupError
from parenting.server.new_run import NewRun, start
from parenting.server.operator_events import add_operator_event
from parenting.server.queue import answers, leases, revisions, worker_side
from parenting.server.replay import relive
from parenting.server.runs import get_run
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.tables import Answer, Query, Run
from tests.database import migrated
from tests.server.conftest import CLIPS

OWN = {"digest", "link", "run"}
"""Columns that an import makes itself."""


@pytest.fixture
def other(tmp_path: Path) -> Iterator[Database]:
    """An empty database elsewhere."""
    database = migrated(Settings(data=tmp_path / "other"))
    yield database
    database.close()


def export(db: Database, numbers: list[int], path: Path) -> Path:
    with target(path) as files:
        write_export(db, numbers, files)
    return path


@pytest.fixture
def folder(db: Database, five: list[int], tmp_path: Path) -> Path:
    return export(db, five, tmp_path / "out")


def table(folder: Path, name: str, but: set[str] = frozenset()) -> list[dict[str, Any]]:  # type: ignore[assignment]
    text = (folder / name).read_text()
    rows: list[dict[str, Any]] = (
        list(csv.DictReader(io.StringIO(text)))
        if name.endswith("csv")
        else [json.loads(line) for line in text.splitlines()]
    )
    return [{key: value for key, value in row.items() if key not in but} for row in rows]


def test_an_imported_run_is_the_same(folder: Path, other: Database, tmp_path: Path) -> None:
    imported = import_export(other, folder)
    assert [(run.number, run.public_id == run.was, run.answers) for run in imported] == [
        (1, True, 6),
        *((number, True, 5) for number in (2, 3, 4, 5)),
    ]
    again = export(other, [run.number for run in imported], tmp_path / "again")
    assert table(again, "answers.jsonl", OWN) == table(folder, "answers.jsonl", OWN)
    for name in ("questions.jsonl", "events.csv", "metrics.csv"):
        assert table(again, name) == table(folder, name)
    assert all(not chain.check(other, run.number).problems for run in imported)


def test_into_the_same_database_with_names_of_its_own(db: Database, folder: Path) -> None:
    imported = import_export(db, folder)
    assert [run.number for run in imported] == [6, 7, 8, 9, 10]
    assert all(run.public_id != run.was for run in imported)
    assert chain.check(db, 6).problems == []
    with db.read() as session:
        assert session.scalar(select(func.count(func.distinct(Query.public_id)))) == 52
    origin = get_run(db, 6).origin
    assert origin is not None
    assert (origin["imported"]["run"], origin["imported"]["number"]) == (imported[0].was, 1)


def raised(db: Database, run: int, until: int) -> RunSession:
    """Live a run until it has so many answers: one is corrected, one event is heard."""
    (mine,) = (claim for claim in runs.claim(db, "worker", -1) if claim.run_id == run)
    session = RunSession(db, mine, get_run(db, run), lambda: None)
    session.save_if_due = lambda: None  # type: ignore[method-assign]
    while (seen := worker_side.watch(db, [run])[run]).answered < until or session.ready(seen):
        if session.ready(seen):
            session.tick(seen)
            continue
        query = leases.lease(db, run, "tab")
        assert query is not None
        answers.answer(db, query.id, ("left", "right", "either")[seen.answered % 3], "tab", "human")
        if seen.answered == 2:
            add_operator_event(db, run, "change", {"name": "p_pref", "value": 0.4})
            revisions.supersede(db, 1, "right", "tab", "human")
    session.save()
    runs.let_go(db, [mine])
    return session


def test_it_is_replayed_to_the_same_bits_and_goes_on_likewise(
    db: Database, other: Database, tmp_path: Path
) -> None:
    start(db, NewRun(world="unsafe-exploration", seed=3, config={"pretrain": False}))
    raised(db, 1, 6)
    import_export(other, export(db, [1], tmp_path / "run.zip"))
    found = relive(other, 1)
    assert (found.equal, found.answers, found.events) == (True, 7, 1)
    for name, one in raised(db, 1, 10).saved.state.tensors().items():
        if name == "learner.params":
            theirs = raised(other, 1, 10).saved.state.tensors()[name]
            assert one.equal(theirs)


def change(folder: Path, name: str, make: Callable[[bytes], bytes]) -> None:
    """Change a file, and its hash in the manifest with it."""
    blob = make((folder / name).read_bytes())
    (folder / name).write_bytes(blob)
    told = json.loads((folder / "manifest.json").read_bytes())
    told["files"][name] |= {"sha256": hashlib.sha256(blob).hexdigest(), "bytes": len(blob)}
    (folder / "manifest.json").write_text(json.dumps(told))


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, Database]]:
    """An export of a small run, and an empty database, which refused imports leave empty."""
    place = tmp_path_factory.mktemp("damages")
    database = migrated(Settings(data=place / "first"))
    start(database, NewRun(world="unsafe-exploration", config={"pretrain": False}))
    (mine,) = runs.claim(database, "test", -1)
    for tick in (1, 3, 5, 7):
        query = worker_side.post_query(database, mine, tick, "guidance", 1, CLIPS)
        answers.answer(database, query, "left", "tab", "human")
        worker_side.take_answer(database, mine, tick + 1)
    add_operator_event(database, 1, "change", {"name": "p_rec", "value": 0.5})
    export(database, [1], place / "out")
    database.close()
    empty = migrated(Settings(data=place / "empty"))
    yield place / "out", empty
    empty.close()


def settings(folder: Path, **values: Any) -> None:
    told = json.loads((folder / "manifest.json").read_bytes())
    told["runs"][0]["settings"] |= values
    (folder / "manifest.json").write_text(json.dumps(told))


def unnamed(folder: Path, name: str) -> None:
    """Change a file of which the manifest says nothing."""
    told = json.loads((folder / "manifest.json").read_bytes())
    del told["files"][name]
    (folder / "manifest.json").write_text(json.dumps(told))
    (folder / name).write_bytes((folder / name).read_bytes() + b"\n")


DAMAGES: dict[str, tuple[Callable[[Path], Any], str]] = {
    "a file is missing": (lambda f: (f / "events.csv").unlink(), "events.csv is missing"),
    "a file was changed": (lambda f: (f / "answers.csv").write_text("x"), "answers.csv is not the file"),
    "no manifest": (lambda f: (f / "manifest.json").unlink(), "manifest.json is missing"),
    "another manifest": (lambda f: (f / "manifest.json").write_text("{}"), "is not an export of Parenting"),
    "no JSON": (lambda f: (f / "manifest.json").write_text("{"), "manifest.json cannot be read"),
    "a newer format": (
        lambda f: (f / "manifest.json").write_text('{"format": "parenting-export", "version": 3}'),
        "format 3, which is newer",
    ),
    "an unknown world": (lambda f: settings(f, world="mars"), "world mars, which is not installed"),
    "a broken config": (lambda f: settings(f, config={"p_guid": 7}), "config"),
    "a status of no run": (
        lambda f: settings(f, status="happy"),
        "run 1: status: 'happy': one of these stands",
    ),
    "an answer too few": (
        lambda f: change(f, "answers.jsonl", lambda b: b"\n".join(b.splitlines()[:3]) + b"\n"),
        "has not the answers",
    ),
    "an answer to nothing": (
        lambda f: change(f, "questions.jsonl", lambda b: b"".join(b.splitlines(True)[1:])),
        "this question is not there",
    ),
    "a row of another run": (
        lambda f: change(f, "questions.jsonl", lambda b: b.replace(b'"run":"', b'"run":"x', 1)),
        "questions.jsonl: row 1: run: 'x",
    ),
    "a file that is not named": (lambda f: unnamed(f, "metrics.csv"), "metrics.csv is not in the manifest"),
    "a cell without an end": (
        lambda f: change(f, "events.csv", lambda b: b + b"x" * 200_000),
        "events.csv: a row cannot be read",
    ),
    "another version": (
        lambda f: (f / "manifest.json").write_text('{"format": "parenting-export", "version": "2"}'),
        "version: '2' is not 2",
    ),
    "a seed of no run": (lambda f: settings(f, seed=-1), "run 1: seed: -1"),
    "a script of no parent": (lambda f: settings(f, script="os.system"), "run 1: script: 'os.system'"),
    "a word for a number": (
        lambda f: change(f, "answers.jsonl", lambda b: b.replace(b'"tick":1,', b'"tick":"one",', 1)),
        "answers.jsonl: row 1: tick: 'one': Input should be a valid integer. Nothing was imported.",
    ),
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.only("sqlite", "nothing of it depends on the store")
def test_what_is_damaged_or_foreign_is_refused(
    written: tuple[Path, Database], tmp_path: Path, damage: str
) -> None:
    refuse(written, tmp_path, *DAMAGES[damage])


def refuse(written: tuple[Path, Database], tmp_path: Path, make: Callable[[Path], Any], told: str) -> None:
    """Damage an export; its import has to say so and to leave nothing."""
    folder, other = Path(shutil.copytree(written[0], tmp_path / "out")), written[1]
    make(folder)
    with pytest.raises(SetupError) as refused:
        import_export(other, folder)
    assert told in refused.value.message
    with other.read() as session:
        assert [session.scalar(select(func.count()).select_from(kind)) for kind in (Run, Query, Answer)] == [
            0
        ] * 3


@pytest.mark.only("sqlite", "nothing of it depends on the store")
def test_a_zip_that_is_cut_off_or_none_is_refused(written: tuple[Path, Database], tmp_path: Path) -> None:
    folder, other = written
    whole = tmp_path / "whole.zip"
    shutil.make_archive(str(whole.with_suffix("")), "zip", folder)
    blob = whole.read_bytes()
    for name, content in {"cut.zip": blob[: len(blob) // 2], "none.zip": b"hello"}.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(SetupError, match=r"nor a zip of an export|is missing or cannot be read"):
            import_export(other, tmp_path / name)
    with ZipFile(tmp_path / "empty.zip", "w"):
        pass
    with pytest.raises(SetupError, match=r"manifest\.json is missing"):
        import_export(other, tmp_path / "empty.zip")


def test_the_auditor_finds_nothing_in_a_life(db: Database, tmp_path: Path) -> None:
    start(db, NewRun(world="unsafe-exploration", seed=3, config={"pretrain": False}))
    raised(db, 1, 6)
    found = audit(export(db, [1], tmp_path / "run.zip"))
    assert (found.problems, found.answers) == ([], 7)


def test_erased_answers_stay_erased(db: Database, five: list[int], other: Database, tmp_path: Path) -> None:
    with db.write() as session:
        session.get_one(Answer, 1).erased = db.clock()
    path = export(db, [1], tmp_path / "out")
    assert (
        table(path, "answers.jsonl")[0] | {"choice": None, "in_x": False, "erased": True}
        == table(path, "answers.jsonl")[0]
    )
    import_export(other, path)
    assert table(export(other, [1], tmp_path / "again"), "answers.jsonl", OWN)[0]["erased"]
    assert (chain.check(other, 1).problems, chain.check(other, 1).erased) == ([], 1)
