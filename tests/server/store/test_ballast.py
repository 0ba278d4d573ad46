"""A full disk: 507, no half rows, reads go on, all resumes by itself; 8 MB are freed at the first refusal."""

import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from sqlalchemy import func, select, text

from parenting.server.db import Database
from parenting.server.errors import BusyError, DiskFullError, RefusedError
from parenting.server.new_run import NewRun, start
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim, claim
from parenting.server.settings import Settings
from parenting.server.store import ballast
from parenting.server.store.ballast import BYTES, Ballast
from parenting.server.tables import Answer
from tests.database import migrated
from tests.server.conftest import CLIPS

DISK_BYTES = 28 * 1024 * 1024


@pytest.fixture
def small_disk() -> Iterator[Path]:
    """A file system of its own in memory."""
    with tempfile.TemporaryDirectory() as folder:
        mounting = ["mount", "-t", "tmpfs", "-o", f"size={DISK_BYTES}", "tmpfs", folder]
        if os.geteuid() != 0 or subprocess.run(mounting, capture_output=True).returncode:
            pytest.skip("only root may mount a file system")
        try:
            yield Path(folder)
        finally:
            subprocess.run(["umount", "--lazy", folder], check=True)


@pytest.fixture
def full(small_disk: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Database]:
    """A database on a small disk, with a ballast."""
    monkeypatch.setattr(ballast, "LOOK_SECONDS", 0.05)
    db = migrated(Settings(data=small_disk, database_url=None))
    db.keep_ballast()
    yield db
    db.close()


def fill(folder: Path) -> Path:
    """Write until nothing more fits."""
    filler = folder / "filler"
    with filler.open("ab", buffering=0) as file, suppress(OSError):
        for size in (2**20, 2**12):
            with suppress(OSError):
                while file.write(b"\0" * size) == size:
                    pass
    assert shutil.disk_usage(folder).free < 4096
    return filler


def until_refused(db: Database, mine: Claim, first: int, most: int) -> tuple[list[int], bool]:
    """Post and answer until the disk is full; the numbers that were told, and whether it was."""
    told: list[int] = []
    for tick in range(first, first + most):
        try:
            query = post_query(db, mine, tick, "guidance", 1, CLIPS)
            told.append(answer(db, query, "left", "a", "human").number)
        except RefusedError:
            return told, True
    return told, False


def test_disk_that_fills_up_costs_one_refusal_until_the_ballast_is_used_up(
    full: Database, small_disk: Path
) -> None:
    file = small_disk / "parenting.db"
    kept = Path(f"{file}-ballast")
    assert kept.exists(), "there is a ballast"
    assert kept.stat().st_blocks * 512 == kept.stat().st_size == BYTES, "it is not sparse"
    assert kept.stat().st_mode & 0o077 == 0
    start(full, NewRun(world="unsafe-exploration"))
    (mine,) = claim(full, "worker-1")
    filler = fill(small_disk)
    told, refused = until_refused(full, mine, 0, 3000)
    assert refused
    assert not kept.exists()
    more, refused = until_refused(full, mine, 5000, 200)
    assert len(more) == 200, "the database goes on in the room that it was given"
    told += more
    fill(small_disk)
    more, refused = until_refused(full, mine, 10_000, 3000)
    told += more
    assert refused
    with full.read() as session:
        assert session.scalar(select(func.count()).select_from(Answer)) == len(told), "reads go on"
    filler.unlink()
    more, refused = until_refused(full, mine, 20_000, 5)
    assert len(more) == 5, "it resumes by itself"
    told += more
    assert told == list(range(1, len(told) + 1))
    with full.read() as session:
        assert session.scalars(select(Answer.number).order_by(Answer.number)).all() == told
        assert session.execute(text("PRAGMA integrity_check")).scalar() == "ok"
    end = time.monotonic() + 30
    while not kept.exists():
        assert time.monotonic() < end, "the ballast was not made again"
        time.sleep(0.02)


def test_without_room_for_it_no_ballast_is_made(small_disk: Path) -> None:
    filler = fill(small_disk)
    kept = Ballast(small_disk / "parenting.db")
    assert not kept.make()
    filler.unlink()
    with (small_disk / "filler").open("wb") as file:
        os.posix_fallocate(file.fileno(), 0, DISK_BYTES - 2 * BYTES + 2**20)
    assert not kept.make(), "it would leave too little"
    assert sorted(path.name for path in small_disk.iterdir()) == ["filler"]
    (small_disk / "filler").unlink()
    assert kept.make()
    assert kept.make()


def test_quota_gives_the_ballast_up_and_a_lock_or_a_sick_disk_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = Ballast(tmp_path / "parenting.db")
    kept.keep()
    for error in (BusyError(), RefusedError()):
        kept.heed(error)
        assert kept.path.exists()

    def over_quota(_descriptor: int, _offset: int, _length: int) -> None:
        raise OSError(122, "Disk quota exceeded")

    monkeypatch.setattr("parenting.server.store.ballast.os.posix_fallocate", over_quota)
    kept.heed(RefusedError())
    assert not kept.path.exists()
    assert list(tmp_path.iterdir()) == []
    kept.close()


def test_refusal_is_said_to_be_a_full_disk(full: Database, small_disk: Path) -> None:
    start(full, NewRun(world="unsafe-exploration"))
    fill(small_disk)
    found = set()
    for _ in range(3):
        fill(small_disk)
        try:
            with full.write() as session:
                session.execute(text("UPDATE run SET level_text = printf('%.*c', 9000000, 'W')"))
        except RefusedError as error:
            found.add(type(error))
    assert found == {DiskFullError}
