"""The last two checkpoints of a run are kept, and a damaged one is recognised."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from sqlalchemy import event, select, text, update

from parenting.server import checkpoint_parts
from parenting.server.checkpoint_pace import CHECKPOINT_SPEED
from parenting.server.checkpoint_parts import sweep_parts
from parenting.server.checkpoints import ended_with_more, load_checkpoints, save_checkpoint, thin
from parenting.server.db import Database
from parenting.server.errors import LostClaimError
from parenting.server.metrics import write_metrics
from parenting.server.migrate import downgrade, upgrade
from parenting.server.runs import Claim, claim, finish, get_run, let_go
from parenting.server.session import RunSession
from parenting.server.snapshot import pack
from parenting.server.statuses import RunStatus
from parenting.server.store.patience import patience
from parenting.server.tables import Checkpoint, CheckpointPart, Run
from tests.server.conftest import Clock


def test_last_two_checkpoints_are_kept(db: Database, mine: Claim) -> None:
    for tick in (10, 20, 30):
        save_checkpoint(db, mine, tick, bytes([tick]))
    assert [(saved.tick, saved.blob, saved.intact) for saved in load_checkpoints(db, mine.run_id)] == [
        (30, b"\x1e", True),
        (20, b"\x14", True),
    ]


def test_checkpoint_of_a_tick_is_replaced(db: Database, mine: Claim) -> None:
    for blob in (b"a", b"b"):
        save_checkpoint(db, mine, 10, blob)
    assert [saved.blob for saved in load_checkpoints(db, mine.run_id)] == [b"b"]


def test_damaged_checkpoint_is_told(db: Database, mine: Claim) -> None:
    for tick in (10, 20):
        save_checkpoint(db, mine, tick, b"state")
    with db.write() as session:
        session.execute(update(Checkpoint).where(Checkpoint.tick == 20).values(blob=b"stata"))
    assert [(saved.tick, saved.intact) for saved in load_checkpoints(db, mine.run_id)] == [
        (20, False),
        (10, True),
    ]


def test_writes_are_fenced(db: Database, mine: Claim, clock: Clock) -> None:
    clock.pass_seconds(6)
    claim(db, "b")
    with pytest.raises(LostClaimError):
        save_checkpoint(db, mine, 1, b"state")
    with pytest.raises(LostClaimError):
        write_metrics(db, mine, {1: {"loss": 0.5}})
    assert load_checkpoints(db, mine.run_id) == []


# Large ones


@pytest.fixture
def part_bytes(monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(checkpoint_parts, "PART_BYTES", 1000)
    return 1000


def blob(first: int, size: int = 4500) -> bytes:
    return bytes((first + at) % 251 for at in range(size))


def parts(db: Database) -> list[tuple[str, int]]:
    """The parcel of each part, and the bytes in it."""
    with db.read() as session:
        rows = session.scalars(select(CheckpointPart).order_by(CheckpointPart.parcel, CheckpointPart.place))
        return [(row.parcel, len(row.blob)) for row in rows]


def test_a_large_checkpoint_reads_as_it_was_written(db: Database, mine: Claim, part_bytes: int) -> None:
    for tick in (10, 20, 30):
        save_checkpoint(db, mine, tick, blob(tick))
    found = load_checkpoints(db, mine.run_id)
    assert [(saved.tick, saved.blob == blob(saved.tick), saved.intact) for saved in found] == [
        (30, True, True),
        (20, True, True),
    ]
    assert sorted(size for _, size in parts(db)) == [500] * 2 + [part_bytes] * 8, "the first is swept away"


def test_no_transaction_writes_more_than_a_part(db: Database, mine: Claim, part_bytes: int) -> None:
    """So nobody waits for a whole checkpoint; nor does its end, or that of a killed writer's parts."""
    with heaviest_transactions(db) as found:
        for tick in (10, 20, 30):
            save_checkpoint(db, mine, tick, blob(tick))
    assert max(bytes_in for bytes_in, _ in found) <= part_bytes + 300
    assert max(deleted for _, deleted in found) == 1


@contextmanager
def heaviest_transactions(db: Database) -> Iterator[list[tuple[int, int]]]:
    """For each transaction, the bytes that its statements brought and the parts that they deleted."""
    found = [(0, 0)]

    def begun(*_: object) -> None:
        found.append((0, 0))

    def executed(_: object, cursor: Any, statement: str, parameters: Any, *__: object) -> None:
        values = parameters.values() if isinstance(parameters, dict) else parameters
        brought = sum(len(value) for value in values if isinstance(value, bytes | memoryview | str))
        deleted = cursor.rowcount if statement.startswith("DELETE FROM checkpoint_part") else 0
        found[-1] = found[-1][0] + brought, found[-1][1] + deleted

    event.listen(db.engine, "begin", begun)
    event.listen(db.engine, "after_cursor_execute", executed)
    yield found
    event.remove(db.engine, "begin", begun)
    event.remove(db.engine, "after_cursor_execute", executed)


def test_others_write_between_any_two_parts(
    db: Database, mine: Claim, part_bytes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a rest the lock is free, within this process and for another connection."""
    rests: list[float] = []

    def write_meanwhile(seconds: float) -> None:
        rests.append(seconds)
        for other in (db, outside):
            with patience(0.5), other.write() as session:
                session.execute(update(Run).values(name=f"rest {len(rests)}"))

    outside = Database(db.engine)
    monkeypatch.setattr("parenting.server.checkpoint_parts.time.sleep", write_meanwhile)
    save_checkpoint(db, mine, 10, blob(1))
    assert len(rests) == 5
    assert min(rests) > 0


class KilledError(Exception):
    """The worker is killed here."""


def kill_at_part(monkeypatch: pytest.MonkeyPatch, last: int) -> None:
    """End the writing of a checkpoint after so many parts."""
    rests = iter(range(1, 1000))

    def killed(_: float) -> None:
        if next(rests) == last:
            raise KilledError

    monkeypatch.setattr("parenting.server.checkpoint_parts.time.sleep", killed)


@pytest.mark.parametrize("last", [1, 5])
def test_parts_of_a_killed_writer_are_no_checkpoint_and_are_swept(
    db: Database, mine: Claim, part_bytes: int, monkeypatch: pytest.MonkeyPatch, last: int
) -> None:
    save_checkpoint(db, mine, 10, blob(1))
    with monkeypatch.context() as killing:
        kill_at_part(killing, last)
        with pytest.raises(KilledError):
            save_checkpoint(db, mine, 20, blob(2))
    assert [(saved.tick, saved.intact) for saved in load_checkpoints(db, mine.run_id)] == [(10, True)]
    assert len(parts(db)) == 5 + last
    sweep_parts(db, mine)
    assert len(parts(db)) == 5
    assert load_checkpoints(db, mine.run_id)[0].blob == blob(1)


def test_a_new_session_sweeps_what_a_killed_writer_left(
    db: Database, mine: Claim, part_bytes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as killing:
        kill_at_part(killing, 3)
        with pytest.raises(KilledError):
            save_checkpoint(db, mine, 20, blob(2))
    RunSession(db, mine, get_run(db, mine.run_id), lambda: None)
    assert parts(db) == []


@pytest.mark.parametrize("damage", ["UPDATE checkpoint_part SET blob = 'x'", "DELETE FROM checkpoint_part"])
@pytest.mark.parametrize("place", [0, 2, 4])
def test_damaged_part_is_told(db: Database, mine: Claim, part_bytes: int, damage: str, place: int) -> None:
    for tick in (10, 20):
        save_checkpoint(db, mine, tick, blob(tick))
    newest = "(SELECT parcel FROM checkpoint WHERE tick = 20)"
    with db.write() as session:
        session.execute(text(f"{damage} WHERE place = {place} AND parcel = {newest}"))
    assert [(saved.tick, saved.intact) for saved in load_checkpoints(db, mine.run_id)] == [
        (20, False),
        (10, True),
    ]


def test_each_part_is_fenced(
    db: Database, mine: Claim, part_bytes: int, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A worker that sleeps past its lease between two parts writes none more, and no checkpoint."""

    def overslept(_: float) -> None:
        clock.pass_seconds(6)
        claim(db, "b")

    monkeypatch.setattr("parenting.server.checkpoint_parts.time.sleep", overslept)
    with pytest.raises(LostClaimError):
        save_checkpoint(db, mine, 10, blob(1))
    assert len(parts(db)) == 1
    assert load_checkpoints(db, mine.run_id) == []


def test_a_checkpoint_in_parts_is_one_piece_for_an_older_version(
    db: Database, mine: Claim, part_bytes: int
) -> None:
    for tick in (10, 20):
        save_checkpoint(db, mine, tick, blob(tick))
    downgrade(db, "0008")
    with db.read() as session:
        rows = session.execute(text("SELECT tick, blob, sha256 FROM checkpoint ORDER BY tick")).all()
    assert [(row.tick, bytes(row.blob)) for row in rows] == [(10, blob(10)), (20, blob(20))]
    assert upgrade(db)
    assert all(saved.intact for saved in load_checkpoints(db, mine.run_id))
    assert len(load_checkpoints(db, mine.run_id)) == 2


@pytest.mark.parametrize(("seconds", "every"), [(0.5, 2.0), (30.0, 30.0), (600.0, 120.0)])
def test_large_checkpoints_are_seldom_but_bound_what_is_repeated(
    db: Database, mine: Claim, monkeypatch: pytest.MonkeyPatch, seconds: float, every: float
) -> None:
    """One megabyte a second on average, whatever the time it took; small ones keep to their two seconds."""
    monkeypatch.setattr("parenting.server.checkpoint_pace.CHECKPOINT_SHARE", 1e9)
    session = RunSession(db, mine, get_run(db, mine.run_id), lambda: None)
    size = len(pack(session.saved))
    monkeypatch.setattr("parenting.server.checkpoint_pace.CHECKPOINT_SPEED", size / seconds)
    session.save()
    assert session._pace.every == pytest.approx(every)
    assert 0 < size < 2 * CHECKPOINT_SPEED, "checkpoints of the built-in levels come every two seconds"


def test_a_large_checkpoint_waits_for_ticks_and_not_for_the_clock(
    db: Database, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run that waits for its parent writes no large checkpoint for a few ticks."""
    session = RunSession(db, mine, get_run(db, mine.run_id), lambda: None)
    saved: list[int] = []
    monkeypatch.setattr(session, "save", lambda: saved.append(session.last_tick))
    session.tick()
    session._pace._saved_at -= 1000.0
    session._pace.every = 100.0
    session.save_if_due()
    assert saved == []
    session._news = False
    assert session._pace.next == math.inf
    assert session.rests_until() > session._pace._saved_at + session._pace.every
    session._pace.work = 101.0
    session.save_if_due()
    assert saved == [1]
    session._pace.every, session._pace.work = 4.0, 0.0
    session.save_if_due()
    assert saved == [1, 1]  # a small one goes by the clock alone


def test_a_run_that_ended_keeps_its_last_checkpoint(db: Database, mine: Claim, part_bytes: int) -> None:
    """Parts of the one before go first, one by one; while a worker has the run, nothing goes."""
    for tick in (1, 2):
        save_checkpoint(db, mine, tick, bytes(3 * part_bytes))
    finish(db, mine, RunStatus.FINISHED, "for the test")
    assert ended_with_more(db) is None
    assert not thin(db, mine.run_id)
    let_go(db, [mine])
    assert ended_with_more(db) == mine.run_id
    assert [thin(db, mine.run_id) for _ in range(5)] == [True] * 4 + [False]
    (last,) = load_checkpoints(db, mine.run_id)
    assert (last.tick, last.intact, ended_with_more(db)) == (2, True, None)
    assert len(parts(db)) == 3


def test_a_failed_run_keeps_both_and_a_damaged_last_checkpoint_is_not_relied_on(
    db: Database, mine: Claim
) -> None:
    for tick in (1, 2):
        save_checkpoint(db, mine, tick, b"state %d" % tick)
    finish(db, mine, RunStatus.FAILED, "for the test")
    let_go(db, [mine])
    assert (ended_with_more(db), thin(db, mine.run_id)) == (None, False)
    with db.write() as session:
        session.execute(update(Run).values(status=RunStatus.STOPPED))
        session.execute(update(Checkpoint).where(Checkpoint.tick == 2).values(blob=b"damaged"))
    assert (ended_with_more(db), thin(db, mine.run_id)) == (mine.run_id, False)
    assert ended_with_more(db, but=[mine.run_id]) is None
    assert [kept.tick for kept in load_checkpoints(db, mine.run_id)] == [2, 1]
