"""A restore replaces a database that nobody uses, keeps it aside, and refuses what it cannot put in place."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from datetime import timedelta
from pathlib import Path

import pytest

from parenting.server.access import sessions, tokens
from parenting.server.access.lookup import find
from parenting.server.access.roles import Role
from parenting.server.access.secret import digest
from parenting.server.backups.making import back_up
from parenting.server.backups.restoring import restore
from parenting.server.db import Database, connect
from parenting.server.errors import SetupError, UsedUpError
from parenting.server.identity import database_id
from parenting.server.migrate import downgrade, require_current, upgrade
from parenting.server.new_run import NewRun, start
from parenting.server.notify import Notifier
from parenting.server.runs import list_runs
from parenting.server.settings import Settings
from parenting.server.store.sqlite import sqlite_module

pytestmark = pytest.mark.only("sqlite", "PostgreSQL is dumped by its own tools: test_dumps.py")


@pytest.fixture
def copy(settings: Settings, db: Database, guidance: int, tmp_path: Path) -> Path:
    """A backup with one run; the database has another one since."""
    made = back_up(settings, tmp_path / "elsewhere" / "copy.db").file
    start(db, NewRun(world="reward-hacking", parent="scripted"))
    db.close()
    return made


@pytest.fixture
def opened(settings: Settings) -> Iterator[Callable[[], Database]]:
    """Open the database of the settings."""
    databases: list[Database] = []

    def open_it() -> Database:
        databases.append(connect(settings))
        return databases[-1]

    yield open_it
    for one in databases:
        one.close()


def worlds(db: Database) -> list[str]:
    return sorted(run.world for run in list_runs(db, 10))


def raw(file: Path, statement: str) -> None:
    with sqlite_module().connect(str(file)) as database:
        database.execute(statement)
    database.close()


def test_it_brings_the_copy_back_and_keeps_the_former_database(
    settings: Settings, copy: Path, opened: Callable[[], Database], tmp_path: Path
) -> None:
    done = restore(settings, copy, replace=True)
    assert worlds(opened()) == ["unsafe-exploration"]
    assert done.aside is not None
    assert done.aside.parent == settings.data / "backups"
    again = restore(Settings(data=tmp_path / "other", database_url=None), done.aside)
    assert again.aside is None
    other = connect(Settings(data=tmp_path / "other", database_url=None))
    assert worlds(other) == ["reward-hacking", "unsafe-exploration"]
    other.close()


def test_a_database_behind_a_link_is_replaced_and_kept_where_it_is(
    settings: Settings, copy: Path, opened: Callable[[], Database], tmp_path: Path
) -> None:
    link, far = settings.data / "parenting.db", tmp_path / "far"
    far.mkdir()
    link.rename(far / "real.db")
    link.symlink_to(Path(os.path.relpath(far / "real.db", link.parent)))
    done = restore(settings, copy, replace=True)
    assert link.is_symlink()
    assert worlds(opened()) == ["unsafe-exploration"]
    assert done.aside is not None
    assert done.aside.parent == far / "backups"
    former = connect(Settings(database_url=f"sqlite:///{done.aside}", data=tmp_path / "other"))
    assert worlds(former) == ["reward-hacking", "unsafe-exploration"]
    former.close()


def test_what_was_revoked_since_does_not_open_again(
    settings: Settings, db: Database, opened: Callable[[], Database], tmp_path: Path
) -> None:
    revoked = tokens.make(db, "program", Role.RESEARCHER)
    link = tokens.make(db, "link", Role.VIEWER)
    seat = sessions.enter(db, link.secret)
    unopened = tokens.make(db, "opening", Role.RESEARCHER)
    made = back_up(settings, tmp_path / "copy.db").file
    tokens.revoke(db, revoked.token.public_id)
    db.close()
    restore(settings, made, replace=True)
    again = opened()
    assert (tokens.list_tokens(again), sessions.list_sessions(again)) == ([], [])
    assert len(tokens.list_tokens(again, all_of_them=True)) == 3
    with again.read() as session:
        for way, secret in (("session", seat.secret), ("token", revoked.secret)):
            assert find(session, way, digest(secret), again.clock(), timedelta(days=7)) is None  # type: ignore[arg-type]
    for secret in (unopened.secret, link.secret):
        with pytest.raises(UsedUpError):
            sessions.enter(again, secret)


def test_a_database_that_exists_is_replaced_only_when_asked(
    settings: Settings, copy: Path, opened: Callable[[], Database]
) -> None:
    with pytest.raises(SetupError, match=r"There is a database at .* Give --replace"):
        restore(settings, copy)
    assert worlds(opened()) == ["reward-hacking", "unsafe-exploration"]


@pytest.mark.parametrize("channel", ["web", "worker"])
def test_never_over_a_living_one(settings: Settings, copy: Path, channel: str) -> None:
    alive = Notifier(settings.data, channel)
    alive.listen()
    with pytest.raises(SetupError, match=r"in use.*Stop `parenting up`"):
        restore(settings, copy, replace=True)
    alive.close()
    restore(settings, copy, replace=True)


def test_the_socket_of_a_killed_process_is_no_sign_of_life(settings: Settings, copy: Path) -> None:
    dead = Notifier(settings.data, "worker")
    dead.listen().close()
    restore(settings, copy, replace=True)


def test_never_while_another_program_has_the_file_open(
    settings: Settings, copy: Path, opened: Callable[[], Database], tmp_path: Path
) -> None:
    """Settings that name the same file from another data folder see no socket."""
    db = opened()
    assert worlds(db)
    there = Settings(data=tmp_path / "other", database_url=f"sqlite:///{settings.data}/parenting.db")
    with pytest.raises(SetupError, match=r"another program has .* open"):
        restore(there, copy, replace=True)
    assert len(worlds(db)) == 2


@pytest.mark.parametrize("size", [0, 1, 5_000, 60_000])
def test_a_damaged_database_is_put_aside_too(
    settings: Settings, copy: Path, opened: Callable[[], Database], size: int
) -> None:
    file = settings.data / "parenting.db"
    os.truncate(file, size)
    Path(f"{file}-wal").write_bytes(b"what was lost")
    done = restore(settings, copy, replace=True)
    assert done.aside is not None
    assert done.aside.stat().st_size == size
    assert worlds(opened()) == ["unsafe-exploration"]


@pytest.mark.parametrize("size", [0, 1, 5_000, 60_000])
def test_a_damaged_backup_changes_nothing(
    settings: Settings, copy: Path, opened: Callable[[], Database], size: int
) -> None:
    os.truncate(copy, size)
    with pytest.raises(SetupError, match=r"is not an SQLite database|cannot be copied|is damaged"):
        restore(settings, copy, replace=True)
    assert worlds(opened()) == ["reward-hacking", "unsafe-exploration"]
    assert list(settings.data.glob("**/*.part")) == []


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("UPDATE alembic_version SET version_num = '9999'", "from a newer version of Parenting"),
        ("DROP TABLE alembic_version", "of another program"),
        ("UPDATE query SET run_id = 77", "is damaged: a row of query names none of run"),
    ],
)
def test_what_this_version_cannot_open_is_refused(
    settings: Settings, copy: Path, statement: str, said: str, opened: Callable[[], Database]
) -> None:
    raw(copy, statement)
    with pytest.raises(SetupError, match=said):
        restore(settings, copy, replace=True)
    assert len(worlds(opened())) == 2


def test_a_file_that_is_missing_or_something_else_is_named(settings: Settings, tmp_path: Path) -> None:
    with pytest.raises(SetupError, match=r"no-file cannot be read"):
        restore(settings, tmp_path / "no-file")
    (tmp_path / "dump").write_bytes(b"PGDMP and more")
    with pytest.raises(SetupError, match="is a dump of PostgreSQL"):
        restore(settings, tmp_path / "dump")
    assert not (settings.data / "parenting.db").exists()


def test_an_older_copy_is_migrated_afterwards(
    settings: Settings, copy: Path, opened: Callable[[], Database], tmp_path: Path
) -> None:
    former = connect(Settings(data=tmp_path, database_url=f"sqlite:///{copy}"))
    downgrade(former, "0004")
    former.close()
    assert restore(settings, copy, replace=True).older
    db = opened()
    with pytest.raises(SetupError, match="older version"):
        require_current(db)
    upgrade(db)
    assert worlds(db) == ["unsafe-exploration"]


def test_a_copy_has_the_identity_of_the_original_unless_it_gets_its_own(
    settings: Settings, copy: Path, tmp_path: Path
) -> None:
    def identity(name: str, **options: bool) -> str:
        there = Settings(data=tmp_path / name, database_url=None)
        restore(there, copy, **options)
        database = connect(there)
        try:
            return database_id(database)
        finally:
            database.close()

    original = identity("one")
    assert identity("two") == original
    assert identity("three", new_identity=True) != original
