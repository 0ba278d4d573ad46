"""A backup is the database of one moment, whole, checked, its owner's, and in nobody's place."""

from __future__ import annotations

import os
import stat
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from parenting.server.backups import copies
from parenting.server.backups.making import back_up
from parenting.server.db import Database
from parenting.server.errors import SetupError
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.settings import Settings
from tests.server.conftest import CLIPS

TRIES = 20

pytestmark = pytest.mark.only("sqlite", "PostgreSQL is dumped by its own tools: test_dumps.py")


class Load:
    """A worker that asks and a parent that answers, without a pause; `told` are the stored answers."""

    def __init__(self, db: Database, mine: Claim) -> None:
        self.db, self.mine, self.told, self.stopping = db, mine, 0, False
        self.changed = threading.Condition()

    def go(self) -> None:
        while not self.stopping:
            query = post_query(self.db, self.mine, self.told + 10, "guidance", 1, CLIPS)
            answer(self.db, query, "left", "tab", "human")
            with self.changed:
                self.told += 1
                self.changed.notify_all()

    def more_than(self, number: int) -> int:
        """The number of told answers, once there are more than this."""
        with self.changed:
            assert self.changed.wait_for(lambda: self.told > number, 60)
            return self.told


@contextmanager
def loaded(db: Database, mine: Claim) -> Iterator[Load]:
    load = Load(db, mine)
    thread = threading.Thread(target=load.go)
    thread.start()
    try:
        yield load
    finally:
        load.stopping = True
        thread.join()


def answers_in(file: Path) -> int:
    return copies.check(file).rows["answer"]


def test_it_has_every_answer_that_was_told_before_it_began(
    settings: Settings, db: Database, mine: Claim, tmp_path: Path
) -> None:
    with loaded(db, mine) as load:
        for number in range(TRIES):
            told = load.more_than(number)
            made = back_up(settings, tmp_path / f"{number}.copy")
            assert told <= answers_in(made.file) <= load.told + 1


def test_the_database_is_open_to_writers_while_it_is_copied(
    settings: Settings, db: Database, guidance: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = copies.copy

    def copy_then_answer(source: Path, target: Path) -> copies.Contents:
        told = real(source, target)
        answer(db, guidance, "left", "tab", "human")
        return told

    monkeypatch.setattr(copies, "copy", copy_then_answer)
    assert answers_in(back_up(settings).file) == 0


def test_it_is_one_file_of_its_owners(settings: Settings, db: Database, guidance: int) -> None:
    made = back_up(settings)
    assert stat.S_IMODE(made.file.stat().st_mode) == 0o600
    assert list(made.file.parent.iterdir()) == [made.file]
    assert made.file.parent == settings.data / "backups"


def test_it_replaces_nothing_unasked(settings: Settings, db: Database, tmp_path: Path) -> None:
    target = tmp_path / "mine"
    target.write_text("precious")
    with pytest.raises(SetupError, match="exists already"):
        back_up(settings, target)
    assert target.read_text() == "precious"
    assert answers_in(back_up(settings, target, force=True).file) == 0


def test_a_file_that_comes_meanwhile_is_not_replaced(
    settings: Settings, db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target, real = tmp_path / "mine", copies.check
    monkeypatch.setattr(copies, "check", lambda part: (target.write_text("precious"), real(part))[1])
    with pytest.raises(SetupError, match="exists already"):
        back_up(settings, target)
    assert target.read_text() == "precious"


def test_the_database_itself_is_no_target(settings: Settings, db: Database) -> None:
    for target in (settings.data / "parenting.db", settings.data / "link.db"):
        if not target.exists():
            os.link(settings.data / "parenting.db", target)
        with pytest.raises(SetupError, match="is the database itself"):
            back_up(settings, target, force=True)


def test_a_copy_that_differs_is_not_kept(
    settings: Settings, db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cut(source: Path, target: Path) -> copies.Contents:
        told = real(source, target)
        target.write_bytes(target.read_bytes()[:-8192])
        return told

    real = copies.copy
    monkeypatch.setattr(copies, "copy", cut)
    with pytest.raises(SetupError, match=r"damaged|malformed"):
        back_up(settings, tmp_path / "folder" / "mine")
    assert list((tmp_path / "folder").iterdir()) == []


def test_nothing_is_begun_without_room(
    settings: Settings, db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.server.backups.whole.shutil.disk_usage", lambda _: Free())
    with pytest.raises(SetupError, match=r"has 0 MB free; \d+ MB more are needed"):
        back_up(settings, tmp_path / "mine")
    assert not (tmp_path / "mine").exists()


class Free:
    """A full disk."""

    free = 0


def test_without_a_database_there_is_nothing_to_copy(settings: Settings) -> None:
    with pytest.raises(SetupError, match="There is no database at"):
        back_up(settings)
    assert not (settings.data / "parenting.db").exists()


@pytest.mark.parametrize("size", [0, 1, 50_000])
def test_a_damaged_database_is_a_sentence(settings: Settings, db: Database, size: int) -> None:
    db.close()
    file = settings.data / "parenting.db"
    os.truncate(file, size)
    with pytest.raises(SetupError, match=r"is not an SQLite database|cannot be copied|is damaged"):
        back_up(settings)
    assert list(settings.data.glob("backups/*")) == []
