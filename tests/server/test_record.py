"""Events, metrics, checkpoints."""

import math

import pytest
from sqlalchemy import update

from parenting.server.db import Database
from parenting.server.errors import Conflict, LostClaimError, NotFound
from parenting.server.record import (
    add_event,
    list_events,
    load_checkpoints,
    metrics,
    save_checkpoint,
    write_metrics,
)
from parenting.server.runs import Claim, claim, set_status
from parenting.server.statuses import RunStatus
from parenting.server.tables import Checkpoint, Run
from tests.server.conftest import Clock


def test_events_are_kept_in_order(db: Database, run: Run) -> None:
    add_event(db, run.id, "mature", {"kind": "mature"})
    add_event(db, run.id, "end_episode", {"kind": "end_episode"})
    assert [(event.kind, event.applied_tick) for event in list_events(db, run.id)] == [
        ("mature", None),
        ("end_episode", None),
    ]


def test_nothing_happens_to_a_run_that_is_over(db: Database, run: Run) -> None:
    set_status(db, run.id, RunStatus.STOPPED)
    with pytest.raises(Conflict, match="is stopped"):
        add_event(db, run.id, "mature", {})
    with pytest.raises(NotFound):
        add_event(db, 99, "mature", {})


def test_metrics_after_a_tick(db: Database, mine: Claim) -> None:
    write_metrics(db, mine, {2: {"loss": 0.5}, 1: {"loss": 0.75, "deaths": 1}})
    assert [(row.tick, row.values) for row in metrics(db, mine.run_id)] == [
        (1, {"loss": 0.75, "deaths": 1}),
        (2, {"loss": 0.5}),
    ]
    assert [row.tick for row in metrics(db, mine.run_id, after=1)] == [2]
    assert [row.tick for row in metrics(db, mine.run_id, limit=1)] == [1]


def test_tick_lived_again_replaces_its_metrics(db: Database, mine: Claim) -> None:
    write_metrics(db, mine, {1: {"loss": 0.5}, 2: {"loss": 0.25}})
    write_metrics(db, mine, {2: {"loss": 0.125}})
    assert [row.values["loss"] for row in metrics(db, mine.run_id)] == [0.5, 0.125]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_stored_as_null(db: Database, mine: Claim, value: float) -> None:
    write_metrics(db, mine, {1: {"loss": value}})
    assert metrics(db, mine.run_id)[0].values == {"loss": None}


def test_metrics_of_an_unknown_run(db: Database) -> None:
    with pytest.raises(NotFound):
        metrics(db, 3)


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
