"""`parenting person delete --remove-backups` removes backups first: killed anywhere, it is given again."""

from __future__ import annotations

from pathlib import Path

import pytest
from sqlalchemy import func, select
from typer.testing import CliRunner, Result

from parenting.commands.main import app
from parenting.server import erasing, erasure
from parenting.server.backups.making import FOLDER
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.persons import pseudonyms
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import claim, let_go
from parenting.server.settings import Settings
from parenting.server.tables import Answer
from tests.server.conftest import CLIPS

pytestmark = pytest.mark.only("sqlite", "the folder of backups is the same with either store")


@pytest.fixture
def person(db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch) -> str:
    """The pseudonym of a person who gave the one answer of a run; the commands find this database."""
    monkeypatch.setenv("PARENTING_DATA", str(settings.data))
    monkeypatch.setenv("PARENTING_DATABASE_URL", settings.url)
    start(db, NewRun(world="unsafe-exploration", config={"pretrain": False}))
    (mine,) = claim(db, "test", -1)
    answer(db, post_query(db, mine, 1, "guidance", 1, CLIPS), "left", "tab", "human")
    let_go(db, [mine])
    return pseudonyms(db, ["tab"])["tab"]


@pytest.fixture
def backup(settings: Settings) -> Path:
    """A file in the folder of backups."""
    file = settings.data / FOLDER / "parenting-1.db"
    file.parent.mkdir()
    file.write_bytes(b"a backup with their data")
    return file


def delete(person: str, *options: str) -> Result:
    return CliRunner().invoke(app, ["person", "delete", person, "--yes", *options])


def answers(db: Database) -> int:
    with db.read() as session:
        return session.scalar(select(func.count()).select_from(Answer)) or 0


def killed(*_: object) -> bool:
    raise KeyboardInterrupt


def test_killed_before_the_data_are_deleted_the_backups_are_gone_and_the_person_can_be_named(
    db: Database, person: str, backup: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(erasing, "delete_person", killed)
        assert delete(person, "--remove-backups").exit_code == 130
    assert (backup.exists(), answers(db)) == (False, 1)
    assert delete(person, "--remove-backups").exit_code == 0
    assert answers(db) == 0


def test_killed_after_their_names_are_gone_it_removes_backups_made_since(
    db: Database, person: str, backup: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(erasure, "scrub", killed)
        assert delete(person, "--remove-backups").exit_code == 130
    assert not backup.exists()
    backup.write_bytes(b"made by a program that still ran")
    again = delete(person, "--remove-backups")
    assert again.exit_code in (0, 3), again.output
    assert not backup.exists()


def test_backups_stay_where_nobody_asks_for_their_removal(db: Database, person: str, backup: Path) -> None:
    done = delete(person)
    assert (done.exit_code, backup.exists()) == (0, True)
    assert "--remove-backups removes them" in done.stderr
