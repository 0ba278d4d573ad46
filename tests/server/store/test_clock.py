"""Wall clocks that jump or differ lose nothing, hold nothing and steal nothing (D5)."""

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from sqlalchemy import text

from parenting.server import workers
from parenting.server.db import Database, connect
from parenting.server.errors import LostClaimError
from parenting.server.migrate import downgrade, upgrade
from parenting.server.new_run import NewRun, start
from parenting.server.progress import report_progress
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease, may_lease
from parenting.server.queue.worker_side import post_query
from parenting.server.reads.schemas import run_schema
from parenting.server.runs import claim
from parenting.server.settings import Settings
from parenting.server.store import clock as store_clock
from parenting.server.store.clock import SLACK, Mark, boot_mark
from tests.database import migrated
from tests.server.conftest import CLIPS
from tests.tree import ROOT

HOURS = [-1, 1]


@pytest.fixture
def db(settings: Settings) -> Iterator[Database]:
    """With the real clocks."""
    database = migrated(settings)
    yield database
    database.close()


@contextmanager
def restarted(settings: Settings, hours: float) -> Iterator[Database]:
    """The database as a process sees it whose wall clock is some hours off."""
    database = connect(settings, lambda: datetime.now(UTC) + timedelta(hours=hours))
    yield database
    database.close()


def let_pass(db: Database, seconds: float) -> None:
    """Everything that is leased, claimed or signed was so for so many seconds more."""
    with db.write() as session:
        for change in (
            "query SET lease_begin = lease_begin - :s, lease_end = lease_end - :s",
            "run SET claim_mark = claim_mark - :s",
            "worker SET mark = mark - :s",
        ):
            session.execute(text(f"UPDATE {change}"), {"s": seconds})


@pytest.fixture
def held(db: Database) -> int:
    """A run that a living worker has claimed, with a question that a parent holds."""
    run = start(db, NewRun(world="unsafe-exploration", config={"stages": 2})).id
    workers.sign(db, "worker-1")
    (mine,) = claim(db, "worker-1", 5)
    post_query(db, mine, 5, "guidance", 1, CLIPS)
    assert lease(db, run, "a", 60) is not None
    return run


@pytest.mark.parametrize("hours", HOURS)
def test_a_clock_that_is_off_ends_nothing_early(
    db: Database, settings: Settings, held: int, hours: float
) -> None:
    with restarted(settings, hours) as other:
        assert claim(other, "worker-2", 5) == []
        assert lease(other, held, "b") is None
        assert not may_lease(other, held, "b")
        assert workers.alive(other) == ["worker-1"]
        assert run_schema(other, held).worker == "alive"


@pytest.mark.parametrize("hours", HOURS)
def test_a_clock_that_is_off_holds_nothing_for_longer(
    db: Database, settings: Settings, held: int, hours: float
) -> None:
    """Leases, claims and signs made with the clock off are over for everybody after their own time."""
    let_pass(db, 61)
    with restarted(settings, hours) as other:
        workers.sign(other, "worker-2")
        (theirs,) = claim(other, "worker-2", 5)
        assert lease(other, held, "b", 60) is not None
        assert claim(db, "worker-3", 5) == []
        assert lease(db, held, "c") is None
        let_pass(db, 5.1)
        assert run_schema(db, held).worker == "silent"
        (mine,) = claim(db, "worker-3", 5)
        assert mine.fencing_token == theirs.fencing_token + 1
        with pytest.raises(LostClaimError):
            report_progress(other, theirs, tick=6)
        assert lease(db, held, "c") is None, "60 s are not over yet"
        let_pass(db, 55)
        assert lease(db, held, "c") is not None
        assert workers.alive(db) == []


@pytest.mark.parametrize("ahead", [30 * SLACK, 3600])  # seconds; the clock goes on while the test runs
def test_what_seems_to_begin_in_the_future_is_over(db: Database, held: int, ahead: float) -> None:
    """As it seems once the clock of PostgreSQL's machine was set back."""
    let_pass(db, -ahead)
    assert workers.alive(db) == []
    assert run_schema(db, held).worker == "silent"
    assert lease(db, held, "b") is not None
    assert [mine.worker for mine in claim(db, "worker-2", 5)] == ["worker-2"]
    assert claim(db, "worker-3", 5) == []


def test_a_correction_by_a_fraction_of_a_second_ends_nothing(db: Database, held: int) -> None:
    let_pass(db, -SLACK / 2)
    assert workers.alive(db) == ["worker-1"]
    assert claim(db, "worker-2", 5) == []
    assert lease(db, held, "b") is None


@pytest.mark.only("sqlite", "PostgreSQL's clock goes on while a machine restarts")
def test_nothing_outlives_the_machine(db: Database, held: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_clock, "_boot_id", lambda: "the next boot")
    assert workers.alive(db) == []
    assert lease(db, held, "b") is not None
    assert len(claim(db, "worker-2", 5)) == 1


def test_what_an_older_version_leased_and_claimed_is_over(db: Database, held: int) -> None:
    downgrade(db, "0006")
    upgrade(db)
    assert lease(db, held, "b") is not None
    assert len(claim(db, "worker-2", 5)) == 1


def test_answers_are_taken_whatever_the_clock_says(db: Database, settings: Settings, held: int) -> None:
    with restarted(settings, -1) as other:
        first = answer(other, 1, "left", "a", "human")
    with restarted(settings, 1) as other:
        assert answer(other, 1, "left", "a", "human") == first


def test_the_clock_is_not_the_wall_clock(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    with db.read() as session:
        before = db.mark(session)
    monkeypatch.setattr(time, "time", lambda: 0.0)
    monkeypatch.setattr(time, "monotonic", lambda: 0.0)
    with db.read() as session:
        after = db.mark(session)
    assert after.epoch == before.epoch
    assert 0 <= after.seconds - before.seconds < 60


def test_all_processes_of_a_machine_have_one_clock() -> None:
    script = "from parenting.server.store.clock import boot_mark; print(*boot_mark())"
    before = boot_mark()
    said = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=ROOT
    )
    epoch, _, seconds = said.stdout.strip().rpartition(" ")
    after = boot_mark()
    assert epoch == before.epoch == after.epoch
    assert before.seconds <= float(seconds) <= after.seconds


def test_a_machine_without_a_boot_id_takes_the_wall_clock(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(store_clock, "BOOT_ID", tmp_path / "none")
    monkeypatch.setattr(store_clock, "SYSCTL", ("false",))
    store_clock._boot_id.cache_clear()
    mark = boot_mark()
    store_clock._boot_id.cache_clear()
    assert mark.epoch == "wall clock"
    assert abs(mark.seconds - time.time()) < 60


@pytest.mark.parametrize(
    ("epoch", "seconds", "recent"),
    [
        ("a", 100.0, True),
        ("a", 95.1, True),
        ("a", 95.0, False),
        ("a", 100.0 + SLACK, True),
        ("a", 100.1 + SLACK, False),
        ("b", 100.0, False),
        (None, None, False),
    ],
)
def test_a_mark_is_recent(epoch: str | None, seconds: float | None, recent: bool) -> None:
    assert Mark("a", 100.0).is_recent(epoch, seconds, 5.0) is recent
