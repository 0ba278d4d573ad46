"""The last two checkpoints of a run are kept, and a damaged one is recognised."""

import pytest
from sqlalchemy import update

from parenting.server.checkpoints import load_checkpoints, save_checkpoint
from parenting.server.db import Database
from parenting.server.errors import LostClaimError
from parenting.server.metrics import write_metrics
from parenting.server.runs import Claim, claim
from parenting.server.tables import Checkpoint
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
