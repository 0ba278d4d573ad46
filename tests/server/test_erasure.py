"""One person's data are deleted: their own runs, their answers in shared ones, all bytes of their marks."""

from __future__ import annotations

from pathlib import Path

import pytest
from sqlalchemy import func, select
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server import checkpoint_pace, erasing, erasure, runs
from parenting.server.audit.entries import entries
from parenting.server.audit.table import Kind
from parenting.server.db import Database
from parenting.server.errors import Conflict
from parenting.server.new_run import start
from parenting.server.notes import PersonErased, notes
from parenting.server.persons import name_person, person_of, pseudonyms
from parenting.server.queue import worker_side
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from parenting.server.tables import Answer, BoardSnapshot, Checkpoint, Person, Run, Tombstone
from parenting.server.verify import verify
from tests.server.raising import ISLAND

ANN, BOB, NAME = "cookie-of-ann-4711", "cookie-of-bob-0815", "Ann Example of Exampleton"
TICKS, SHARED = 24, 1


def raise_by(db: Database, run_id: int, people: tuple[str, ...], ticks: int = TICKS) -> None:
    """Raise a run whose questions these people answer in turn; save it at the end, and let it go."""
    with db.write() as session:
        session.get_one(Run, run_id).worker = None
    (mine,) = [one for one in runs.claim(db, "worker") if one.run_id == run_id]
    life, said = RunSession(db, mine, runs.get_run(db, run_id), lambda: None), 0
    while life.last_tick < ticks:
        seen = worker_side.watch(db, [run_id])[run_id]
        if life.ready(seen):
            life.tick(seen)
        elif (query := lease(db, run_id, people[said % len(people)])) is not None:
            answer(db, query.id, ("left", "right", "either")[said % 3], people[said % len(people)], "human")
            said += 1
        else:
            break
    life.end()
    runs.let_go(db, [mine])
    assert said >= 2 * len(people)


@pytest.fixture
def ann(db: Database, monkeypatch: pytest.MonkeyPatch) -> str:
    """The pseudonym of a person who raised a run together with another one, and one alone."""
    monkeypatch.setattr(checkpoint_pace, "CHECKPOINT_SECONDS", 1e9)
    assert start(db, ISLAND.new("human")).id == SHARED
    raise_by(db, SHARED, (ANN, BOB))
    raise_by(db, start(db, ISLAND.new("human")).id, (ANN,), 8)
    found = pseudonyms(db, [ANN])[ANN]
    name_person(db, found, NAME, "external-0042")
    return found


def marks_in(folder: Path, *marks: str) -> dict[str, list[str]]:
    """Where the bytes of a folder hold a mark."""
    files = [file for file in folder.rglob("*") if file.is_file()]
    return {mark: [file.name for file in files if mark.encode() in file.read_bytes()] for mark in marks}


def left_behind(db: Database) -> tuple[int, int]:
    """The number of answers that are hers, and of those that were erased."""
    with db.read() as session:
        hers = select(func.count()).select_from(Answer).where(Answer.client_id == ANN)
        gone = select(func.count()).select_from(Answer).where(Answer.erased.is_not(None))
        return session.scalar(hers) or 0, session.scalar(gone) or 0


def hers_in(db: Database, run_id: int) -> int:
    with db.read() as session:
        rows = select(func.count()).select_from(Answer)
        return session.scalar(rows.where(Answer.client_id == ANN, Answer.run_id == run_id)) or 0


@pytest.mark.only("sqlite")
def test_no_byte_of_theirs_is_left(db: Database, ann: str, settings: Settings) -> None:
    marks = (ANN, ann, NAME, "external-0042")
    assert all(marks_in(settings.data, *marks).values()), "they are there before"
    assert erasing.delete_person(db, ann)
    assert not any(marks_in(settings.data, *marks).values())
    assert marks_in(settings.data, BOB)[BOB], "the other person's are"


def test_runs_of_theirs_go_and_shared_ones_forget_them(db: Database, ann: str) -> None:
    runs.set_status(db, SHARED, RunStatus.STOPPED)  # one that is over forgets them, too
    before = erasure.plan(db, ann)
    assert (before.alone, before.shared) == ([2], [SHARED])
    theirs, erased = left_behind(db)
    standing = runs.get_run(db, SHARED).standing
    in_shared = hers_in(db, SHARED)
    assert 0 < in_shared < theirs
    assert erasing.delete_person(db, ann)
    assert erased == 0
    assert left_behind(db) == (0, in_shared)
    assert runs.get_run(db, SHARED).standing == standing - in_shared
    with db.read() as session:
        assert [one.id for one in session.scalars(select(Tombstone))] == [2]
        (kept,) = session.scalars(select(Checkpoint).where(Checkpoint.run_id == SHARED)).all()
        snapshots = session.scalars(select(BoardSnapshot.tick).where(BoardSnapshot.run_id == SHARED)).all()
        assert set(snapshots) <= {kept.tick}
        assert session.scalar(select(func.count()).select_from(Person)) == 1
    told = [(row.what, row.run) for row in reversed(entries(db, kind=Kind.DELETION).rows)]
    assert told[:2] == [("a person's data", None), ("a person's answers", runs.get_run(db, SHARED).public_id)]
    assert [what for what, _ in told[2:]] == ["run 2"]
    assert [(tick, note) for tick, note in notes(db, SHARED)] == [
        (kept.tick, PersonErased(answers=in_shared))
    ]


@pytest.mark.slow
def test_what_is_left_is_verified_and_goes_on(db: Database, ann: str) -> None:
    whole = verify(db, SHARED)
    assert (whole.sound, whole.chain.erased) == (True, 0)
    assert erasing.delete_person(db, ann)
    found = verify(db, SHARED)
    assert (found.chain.problems, found.x, found.sound) == ([], None, True)
    assert found.chain.erased > 1
    assert found.replayed is not None
    assert found.replayed.erased is not None
    assert found.replayed.tick == found.replayed.erased - 1, "no replay goes further"
    raise_by(db, SHARED, (BOB,), 2 * TICKS)
    later = verify(db, SHARED)
    assert (later.sound, later.x) == (True, None)
    assert (later.checkpoint or 0) > (found.checkpoint or 0)


@pytest.mark.slow
@pytest.mark.parametrize("place", ["erasing.save_checkpoint", "erasure.scrub"])
def test_a_deletion_that_is_cut_off_goes_on(
    db: Database, ann: str, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    def cut(*_: object) -> bool:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(f"parenting.server.{place}", cut)
        with pytest.raises(KeyboardInterrupt):
            erasing.delete_person(db, ann)
    assert verify(db, SHARED).sound, "nothing is half done in a run"
    (left,) = erasure.under_way(db)
    if place.endswith("save_checkpoint"):
        with db.write() as session, pytest.raises(Conflict, match="being deleted"):
            person_of(session, ANN, db.clock())
    assert erasing.go_on(db, left.id)
    assert erasure.under_way(db) == []
    assert left_behind(db)[0] == 0


@pytest.mark.slow
def test_the_command_says_what_goes_and_asks(
    db: Database, ann: str, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARENTING_DATA", str(settings.data))
    monkeypatch.setenv("PARENTING_DATABASE_URL", settings.url)
    listed = CliRunner().invoke(app, ["person", "list"])
    assert f"{ann} ({NAME}, external-0042): " in listed.stdout
    refused = CliRunner().invoke(app, ["person", "delete", ann])
    assert (refused.exit_code, "Give --yes" in refused.stderr) == (2, True)
    assert left_behind(db)[0] > 0
    done = CliRunner().invoke(app, ["person", "delete", ann, "--yes"])
    assert (done.exit_code, done.stdout) == (0, f"The data of {ann} are deleted.\n")
    assert "Deleted as a whole, since nobody else answered: runs 2." in done.stderr
    assert "Their answers leave X, and earlier checkpoints and snapshots go: runs 1." in done.stderr
    assert CliRunner().invoke(app, ["person", "delete", ann, "--yes"]).exit_code == 2
