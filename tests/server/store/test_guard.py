"""The database file removed, renamed or replaced while it is in use: nobody is told of a thing not kept."""

import os
from collections.abc import Callable
from pathlib import Path

import httpx2
import pytest
from sqlalchemy import PoolProxiedConnection, event, select

from parenting.server.backups.restoring import restore
from parenting.server.db import Database, connect
from parenting.server.errors import DiskFullError, GoneError, ServerError
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.settings import Settings
from parenting.server.store.driver import sqlite_module
from parenting.server.tables import Answer
from parenting.server.workers import sign
from tests.server.conftest import CLIPS

pytestmark = pytest.mark.only("sqlite", "PostgreSQL keeps its own files")


def file_of(db: Database) -> Path:
    return Path(str(db.engine.url.database))


def copy(source: Path, target: Path) -> None:
    """A copy of one moment, without a log."""
    raw = sqlite_module().connect(str(source))
    raw.execute("VACUUM INTO ?", (str(target),))
    raw.close()


def numbers(db: Database) -> list[int]:
    with db.read() as session:
        return list(session.scalars(select(Answer.number).order_by(Answer.number)))


def away_file(file: Path) -> Callable[[], object]:
    file.rename(file.with_suffix(".away"))
    return lambda: file.with_suffix(".away").rename(file)


def away_log(file: Path) -> Callable[[], object]:
    log = Path(f"{file}-wal")
    log.rename(file.with_suffix(".log"))
    return lambda: file.with_suffix(".log").rename(log)


def away_folder(file: Path) -> Callable[[], object]:
    aside = file.parent.with_name("aside")
    file.parent.rename(aside)
    return lambda: aside.rename(file.parent)


@pytest.mark.parametrize("away", [away_file, away_log, away_folder])
def test_nothing_is_told_while_it_is_away_and_all_goes_on_once_it_is_back(
    db: Database, mine: Claim, guidance: int, away: Callable[[Path], Callable[[], object]]
) -> None:
    assert lease(db, mine.run_id, "a") is not None
    back = away(file_of(db))
    for attempt in (
        lambda: answer(db, guidance, "left", "a", "human"),
        lambda: numbers(db),
        lambda: lease(db, mine.run_id, "b"),
        db.data_version,
    ):
        with pytest.raises(GoneError, match="while Parenting was running"):
            attempt()
    back()
    assert numbers(db) == [], "what was refused was not stored"
    assert answer(db, guidance, "left", "a", "human").number == 1
    other = connect_again(db)
    assert numbers(other) == [1]
    other.close()


def connect_again(db: Database) -> Database:
    return connect(Settings(data=file_of(db).parent, database_url=None))


@pytest.mark.parametrize("moment", ["before", "after"])
def test_file_removed_around_the_commit_is_noticed_before_the_reply(
    db: Database, guidance: int, moment: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After the commit the answer is in a file that nobody finds; so it must not be told."""

    def remove(*told: object) -> None:
        if str(told[2]).startswith("INSERT INTO answer"):
            file_of(db).unlink()

    real = db.engine.dialect.do_commit

    def commit(raw: PoolProxiedConnection) -> None:
        real(raw)
        file_of(db).unlink()

    if moment == "before":
        event.listen(db.engine, "before_cursor_execute", remove)
    else:
        monkeypatch.setattr(db.engine.dialect, "do_commit", commit)
    kept = file_of(db).with_suffix(".kept")
    os.link(file_of(db), kept)
    with pytest.raises(GoneError, match="was removed"):
        answer(db, guidance, "left", "a", "human")
    if moment == "before":
        event.remove(db.engine, "before_cursor_execute", remove)
    else:
        monkeypatch.undo()
    kept.rename(file_of(db))
    assert numbers(db) == ([] if moment == "before" else [1]), "before the commit it is given up"
    assert answer(db, guidance, "left", "a", "human").number == 1, "sent again, it gets its reply"


@pytest.mark.usefixtures("guidance")
def test_api_says_503_and_page_of_a_run_too(db: Database, client: httpx2.Client) -> None:
    back = away_file(file_of(db))
    for path in ("/api/v1/runs", "/api/v1/runs/1/metrics"):
        found = client.get(path)
        assert found.status_code == 503
        assert found.json()["error"]["code"] == "store_gone"
        assert "parenting restore" in found.json()["error"]["message"]
    back()
    assert client.get("/api/v1/runs").status_code == 200


def test_it_is_ready_as_soon_as_the_file_is_back(db: Database, client: httpx2.Client, guidance: int) -> None:
    """A write was refused meanwhile; only what the beginning of a write cannot meet is remembered."""
    sign(db, "worker")
    back = away_file(file_of(db))
    body = {"choice": "left", "client_id": "ann"}
    assert client.post(f"/api/v1/queries/{guidance}/answer", json=body).status_code == 503
    assert "store: store_gone" in client.get("/readyz").json()["error"]["message"]
    back()
    assert client.get("/readyz").status_code == 200


def test_it_is_not_ready_while_the_last_write_met_a_full_disk(
    db: Database, client: httpx2.Client, guidance: int
) -> None:
    sign(db, "worker")

    def fill(*_arguments: object) -> None:
        raise DiskFullError

    event.listen(db.engine, "before_cursor_execute", fill)
    with pytest.raises(DiskFullError):
        answer(db, guidance, "left", "a", "human")
    event.remove(db.engine, "before_cursor_execute", fill)
    assert "store: disk_full" in client.get("/readyz").json()["error"]["message"]
    answer(db, guidance, "left", "a", "human")
    assert client.get("/readyz").status_code == 200


def test_another_database_in_its_place_is_not_taken(
    db: Database, mine: Claim, guidance: int, tmp_path: Path
) -> None:
    answer(db, guidance, "left", "a", "human")
    file, other = file_of(db), tmp_path / "other.db"
    copy(file, other)
    raw = sqlite_module().connect(str(other))
    raw.execute("UPDATE database_identity SET uuid = 'another'")
    raw.commit()
    raw.close()
    kept = file.with_suffix(".kept")
    os.link(file, kept)
    other.replace(file)
    before = file.read_bytes()
    for _ in range(3):
        with pytest.raises(GoneError, match=r"was replaced .* restart"):
            post_query(db, mine, 9, "guidance", 1, CLIPS)
    assert file.read_bytes() == before
    kept.replace(file)
    assert numbers(db) == [1], "the former file is back"


def test_older_state_of_the_same_database_is_not_taken(db: Database, guidance: int, tmp_path: Path) -> None:
    older = tmp_path / "older.db"
    copy(file_of(db), older)
    answer(db, guidance, "left", "a", "human")
    older.replace(file_of(db))
    for _ in range(3):
        with pytest.raises(GoneError, match="was replaced"):
            numbers(db)


def test_copy_with_all_that_was_told_is_taken_and_kept_in(
    db: Database, mine: Claim, guidance: int, tmp_path: Path
) -> None:
    """Some programs save a file by a new one under its name. The log of the new one must not be removed."""
    answer(db, guidance, "left", "a", "human")
    same = tmp_path / "same.db"
    copy(file_of(db), same)
    for end in ("-wal", "-shm"):
        Path(f"{file_of(db)}{end}").unlink()
    same.replace(file_of(db))
    told = []
    for tick in range(10, 14):
        try:
            query = post_query(db, mine, tick, "guidance", 1, CLIPS)
            told.append(answer(db, query, "left", "a", "human").number)
        except ServerError:
            continue
    assert told == [2, 3, 4, 5]
    fresh = connect_again(db)
    assert numbers(fresh) == [1, *told]
    fresh.close()
    db.close()
    fresh = connect_again(db)
    assert numbers(fresh) == [1, *told], "also after all connections were closed"
    fresh.close()


def test_log_that_is_lost_is_written_back_by_a_stop_in_order(
    db: Database, mine: Claim, guidance: int, settings: Settings
) -> None:
    assert answer(db, guidance, "left", "a", "human").number == 1
    query = post_query(db, mine, 9, "guidance", 1, CLIPS)
    Path(f"{file_of(db)}-wal").unlink()
    used = db.engine.raw_connection()  # none is left in the pool, so another is to be opened
    with pytest.raises(GoneError, match="SIGTERM"):
        answer(db, query, "left", "a", "human")
    used.close()
    assert not Path(f"{file_of(db)}-wal").exists(), "no second log is begun beside the first"
    db.close()
    again = connect(settings)
    assert numbers(again) == [1]
    assert answer(again, query, "left", "a", "human").number == 2
    again.close()


@pytest.mark.parametrize("replaced", [False, True])
def test_what_was_told_is_copied_from_a_file_that_was_removed_for_good(
    db: Database, mine: Claim, guidance: int, settings: Settings, tmp_path: Path, replaced: bool
) -> None:
    older = tmp_path / "older.db"
    copy(file_of(db), older)
    assert lease(db, mine.run_id, "a") is not None
    assert answer(db, guidance, "left", "a", "human").number == 1
    query = post_query(db, mine, 9, "guidance", 1, CLIPS)
    if replaced:
        older.replace(file_of(db))
    else:
        file_of(db).unlink()
    for _ in range(3):
        with pytest.raises(GoneError):
            answer(db, query, "left", "a", "human")
    db.close()
    (kept,) = (settings.data / "backups").iterdir()
    assert kept.stat().st_mode & 0o077 == 0
    restore(settings, kept, replace=replaced)
    again = connect(settings)
    assert numbers(again) == [1]
    assert answer(again, query, "left", "a", "human").number == 2
    again.close()


def test_file_that_was_only_renamed_is_not_copied(db: Database, guidance: int, settings: Settings) -> None:
    back = away_file(file_of(db))
    with pytest.raises(GoneError):
        answer(db, guidance, "left", "a", "human")
    assert not (settings.data / "backups").exists()
    back()
