"""A migration copies the database first; without room for that it does not begin."""

from __future__ import annotations

import tarfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server.backups import before_migrating, copies
from parenting.server.backups.before_migrating import KEPT, migrate
from parenting.server.db import Database, connect
from parenting.server.migrate import newest, revision
from parenting.server.settings import Settings
from tests.tree import ROOT


@pytest.fixture
def old(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Settings:
    """The data folder of version 0.1.0."""
    with tarfile.open(ROOT / "tests/old/0.1.0/data.tar.xz") as archive:
        archive.extractall(tmp_path, filter="data")
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path / "data"))
    return Settings(data=tmp_path / "data", database_url=None)


@pytest.fixture
def db(old: Settings) -> Iterator[Database]:
    database = connect(old)
    yield database
    database.close()


def kept(settings: Settings) -> list[Path]:
    return sorted((settings.data / "backups").glob("*"))


def test_the_copy_is_the_database_as_it_was(old: Settings, db: Database) -> None:
    before = copies.check(old.data / "parenting.db")
    assert migrate(db, old.data) is True
    (copy,) = kept(old)
    assert copy.name.startswith(f"before-migration-{before.revision}-")
    assert copies.check(copy) == before
    assert revision(db) == newest() != before.revision


def test_there_is_none_where_nothing_changes(old: Settings, db: Database, tmp_path: Path) -> None:
    fresh = connect(Settings(data=tmp_path / "fresh", database_url=None))
    assert migrate(fresh, tmp_path / "fresh") is True
    assert migrate(fresh, tmp_path / "fresh") is False
    fresh.close()
    assert not (tmp_path / "fresh" / "backups").exists()
    assert migrate(db, old.data, backup=False) is True
    assert kept(old) == []


def test_a_second_one_within_the_same_second_is_kept_too(
    old: Settings, db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A migration that was killed is begun again at once."""
    monkeypatch.setattr(before_migrating, "stamp", lambda _: "20260101T000000Z")
    first = before_migrating.keep(db, old.data, "0003")
    assert migrate(db, old.data) is True
    assert [copy.name for copy in kept(old)] == [first.name, "before-migration-0003-20260101T000000Z_2.db"]


class Full:
    """A full disk."""

    free = 0


def test_without_room_nothing_is_changed_unless_it_is_asked_for(
    old: Settings, db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.server.backups.whole.shutil.disk_usage", lambda _: Full())
    before = revision(db)
    said = CliRunner().invoke(app, ["migrate"])
    assert said.exit_code == 2
    assert said.stderr.endswith("Free some space, or go on without a copy: parenting migrate --no-backup\n")
    assert revision(db) == before
    assert CliRunner().invoke(app, ["migrate", "--no-backup"]).exit_code == 0
    assert revision(db) == newest()


@pytest.mark.slow
def test_the_last_few_are_kept(old: Settings, db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    (old.data / "backups").mkdir()
    (old.data / "backups" / "before-restore-20000101T000000Z.db").touch()
    ours = [f"20260101T00000{number}Z" for number in range(2 * KEPT)]
    for number, stamp in enumerate(ours):
        monkeypatch.setattr(before_migrating, "stamp", lambda _, stamp=stamp: stamp)
        migrate(db, old.data, to=None if number % 2 == 0 else "0003")
    stamps = sorted(file.stem.rpartition("-")[2] for file in kept(old))
    assert stamps == ["20000101T000000Z", *ours[-KEPT:]]
