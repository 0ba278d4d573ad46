"""PostgreSQL as it has to be set: waits have bounds, reads only read, no commit is overlooked (D1, D2)."""

import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from sqlalchemy import Connection, event, select, text

from parenting.server.db import Database, connect
from parenting.server.errors import BusyError, GoneError, RefusedError, SetupError
from parenting.server.migrate import downgrade, require_current, upgrade
from parenting.server.operator_events import add_operator_event
from parenting.server.progress import report_progress
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.runs import Claim
from parenting.server.settings import Settings
from parenting.server.store import postgresql
from parenting.server.tables import Run
from tests.database import database_url, unmigrated

pytestmark = pytest.mark.only("postgresql", "the settings of PostgreSQL itself")


def shown(db: Database, name: str) -> str:
    with db.read() as session:
        return str(session.execute(text(f"SHOW {name}")).scalar_one())


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("lock_timeout", "5s"),
        ("statement_timeout", "15s"),
        ("idle_in_transaction_session_timeout", "10s"),
        ("transaction_read_only", "on"),
        ("transaction_isolation", "repeatable read"),
    ],
)
def test_every_read_has_its_limits(db: Database, name: str, value: str) -> None:
    assert shown(db, name) == value
    assert shown(db, name) == value, "the same connection once more"


def test_a_write_after_a_read_may_write(db: Database, run: Run) -> None:
    shown(db, "lock_timeout")
    with db.write() as session:
        assert session.execute(text("SHOW transaction_read_only")).scalar_one() == "off"
        assert session.execute(text("SHOW transaction_isolation")).scalar_one() == "read committed"


def test_a_read_cannot_write(db: Database, run: Run) -> None:
    with pytest.raises(RefusedError), db.read() as session:
        session.execute(text("UPDATE run SET tick = 7"))


def test_a_read_is_of_one_moment(db: Database, run: Run) -> None:
    with db.read() as session:
        session.execute(text("SELECT 1 FROM run")).all()
        with db.write() as other:
            other.get_one(Run, run.id).tick = 9
        assert session.scalars(select(Run.tick)).one() == 0


@pytest.mark.parametrize(
    ("verb", "committing"),
    [
        (lambda db, mine, query: answer(db, query, "left", "a", "human"), "on"),
        (lambda db, mine, query: post_query(db, mine, 9, "guidance", 1, {}), "on"),
        (lambda db, mine, query: add_operator_event(db, mine.run_id, "end_episode", {}), "on"),
        (lambda db, mine, query: lease(db, mine.run_id, "a"), "on"),
        (lambda db, mine, query: take_answer(db, mine, 9), "off"),
        (lambda db, mine, query: report_progress(db, mine, tick=9), "off"),
    ],
)
def test_what_somebody_was_told_is_on_the_disk_at_once(
    db: Database, mine: Claim, guidance: int, verb: Callable[..., object], committing: str
) -> None:
    found: list[object] = []

    def look(connection: Connection) -> None:
        found.append(connection.exec_driver_sql("SHOW synchronous_commit").scalar())

    event.listen(db.engine, "commit", look)
    verb(db, mine, guidance)
    assert found == [committing]


def test_a_row_that_stays_locked_is_busy(
    db: Database, settings: Settings, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(postgresql.LIMITS, "lock_timeout", 50)
    other = connect(settings)
    with db.write() as session:
        session.get_one(Run, run.id, with_for_update=True)
        with pytest.raises(BusyError):
            report_progress(other, Claim(run.id, "nobody", 0), tick=1)
    other.close()


@pytest.mark.slow
def test_who_stands_still_in_a_write_holds_up_nobody_for_long(
    db: Database, settings: Settings, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(postgresql.LIMITS, "idle_in_transaction_session_timeout", 1000)
    slow = connect(settings)

    def write_too_slowly() -> None:
        with slow.write() as session:
            session.get_one(Run, run.id, with_for_update=True).name = "too late"
            session.flush()
            with db.write() as healthy:  # waits for the lock until the server ends the other transaction
                healthy.get_one(Run, run.id, with_for_update=True).name = "went on"

    with pytest.raises((BusyError, GoneError)):
        write_too_slowly()
    with db.read() as session:
        assert session.get_one(Run, run.id).name == "went on"
    slow.close()


def test_other_limits_and_parameters_may_stand_in_the_url(settings: Settings, db: Database) -> None:
    url = f"{settings.database_url}&options=-c%20statement_timeout%3D7s&application_name=mine"
    other = connect(Settings(data=settings.data, database_url=url))
    assert shown(other, "statement_timeout") == "7s"
    assert shown(other, "lock_timeout") == "5s"
    assert shown(other, "application_name") == "mine"
    other.close()


def test_server_that_is_away_is_gone_within_the_bound(tmp_path: Path) -> None:
    url = f"postgresql:///parenting?host={tmp_path}&user=me&password=s3cret"
    db = connect(Settings(data=tmp_path, database_url=url))
    with pytest.raises(GoneError) as said, db.read() as session:
        session.execute(text("SELECT 1"))
    assert "s3cret" not in f"{said.value.message}{said.value.body()}"
    db.close()


@pytest.mark.parametrize(
    "url",
    [
        "oracle+nothing://me:s3cret@host/a",
        "mysql://me:s3cret@host/a",
        "s3cret@host:",
        "postgresql+asyncpg://me:s3cret@host/a",
        "postgresql://me:s3cret@host/a?bogus=1",
        "postgresql://me:s3cret@host/a?port=many",
        "postgresql://me:s3cret@host/a?connect_timeout=long",
        "postgresql://me:x@s3cret@host/a",
    ],
)
def test_what_a_wrong_url_says_holds_no_password(url: str, tmp_path: Path) -> None:
    with pytest.raises(SetupError, match="PARENTING_DATABASE_URL") as said:
        connect(Settings(data=tmp_path, database_url=url))
    assert "s3cret" not in said.value.message


def test_missing_driver_is_told_with_its_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "psycopg", None)
    with pytest.raises(SetupError, match=r"pip install 'parenting\[postgres\]'"):
        connect(Settings(data=tmp_path, database_url="postgresql://me@host/a"))


def test_poll_looks_again_only_after_a_commit(db: Database, settings: Settings, run: Run) -> None:
    other, looks = connect(settings), []

    def look() -> int:
        looks.append(1)
        return len(looks)

    def polls() -> list[int]:
        return [db.cached("a", look) for _ in range(3)]

    first = polls()
    assert first[1] == first[2], "nobody wrote"
    for writer in (other, db):
        before = len(looks)
        with writer.write() as session:
            session.get_one(Run, run.id).tick += 1
            session.flush()
            db.cached("a", look)  # another transaction has begun: that may be looked at, or not
        after = polls()
        assert after[0] > before
        assert after[0] == after[1] == after[2], "nobody wrote since"
    other.close()


def test_no_commit_is_overlooked_among_many(db: Database, settings: Settings, run: Run) -> None:
    """Writers overlap, so commits come in another order than transactions began; each poll sees them all."""
    others = [connect(settings) for _ in range(4)]
    missed: list[int] = []
    watching = threading.Lock()

    def ticks() -> int:
        with db.read() as session:
            return session.execute(text("SELECT sum(tick) FROM worker_ticks")).scalar_one() or 0

    with db.write() as session:
        session.execute(text("CREATE TABLE worker_ticks (who int PRIMARY KEY, tick bigint)"))
        session.execute(text("INSERT INTO worker_ticks SELECT n, 0 FROM generate_series(0, 3) n"))
    told = [0] * len(others)

    def write(who: int) -> None:
        for number in range(1, 31):
            with others[who].write() as session:
                session.execute(text(f"UPDATE worker_ticks SET tick = {number} WHERE who = {who}"))
            with watching:
                told[who] = number
                known = sum(told)
                if db.cached("ticks", ticks) < known:
                    missed.append(known)

    threads = [threading.Thread(target=write, args=(who,)) for who in range(len(others))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert missed == []
    assert db.cached("ticks", ticks) == 4 * 30
    for other in others:
        other.close()


def test_the_poll_connects_again_after_its_connection_was_lost(db: Database, run: Run) -> None:
    db.data_version()
    with db.write() as session:
        session.execute(
            text(
                "SELECT pg_terminate_backend(pid) FROM pg_stat_activity "
                "WHERE pid != pg_backend_pid() AND usename = current_user"
            )
        )
    with pytest.raises(GoneError):
        db.data_version()
    assert db.data_version() == db.data_version()


def test_of_many_who_migrate_at_once_one_does(settings: Settings) -> None:
    with database_url("postgresql") as url:
        own = Settings(data=settings.data, database_url=url)
        starters = [unmigrated(own)] + [connect(own) for _ in range(3)]
        done: list[bool] = []
        threads = [threading.Thread(target=lambda one=one: done.append(upgrade(one))) for one in starters]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert sorted(done) == [False, False, False, True]
        for one in starters:
            require_current(one)
            one.close()


@pytest.mark.slow
def test_a_migration_may_take_longer_than_other_writes(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(postgresql.LIMITS, "idle_in_transaction_session_timeout", 50)
    slow = connect(settings)

    def keep(_revision: str) -> Path:
        time.sleep(0.2)
        return settings.data

    downgrade(slow, "0004", keep)
    assert upgrade(slow, keep) is True
    slow.close()
