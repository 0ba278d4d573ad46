"""Snapshots of policies that take long: computed a portion at a time, out of the way of a life."""

from __future__ import annotations

import base64
import math
import random

import httpx2
import pytest
from sqlalchemy import delete, select, update

from parenting.server import runs
from parenting.server.board import states as known_states
from parenting.server.board import store, sweep, writer
from parenting.server.board.columns import unpack
from parenting.server.board.store import COUNTS_ALONE, Numbers
from parenting.server.board_tables import BoardSnapshot, BoardStates
from parenting.server.db import Database
from parenting.server.queue.worker_side import watch
from parenting.server.runs import Claim
from parenting.server.session import RunSession
from parenting.server.statuses import RunStatus
from parenting.server.work.held import HeldRuns
from parenting.server.work.patience import Patience
from tests.server.board.test_board import begin, live


def small_portions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a portion be one batch of one state, as on the largest boards."""
    for module in (known_states, sweep):
        monkeypatch.setattr(module, "GLYPHS_AT_ONCE", 1)


def ticks(db: Database, life: RunSession) -> list[int]:
    return ticks_of(db, life.claim.run_id)


def ticks_of(db: Database, run_id: int) -> list[int]:
    return [row.tick for row in store.list_snapshots(db, run_id)]


@pytest.mark.slow
def test_a_snapshot_is_of_the_tick_at_which_it_was_begun(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    small_portions(monkeypatch)
    life = begin(db, "unsafe-exploration")
    live(life, 1)
    assert life.board.busy
    parameters = life.saved.state.learner.params.clone()
    states = len(life.board._states.cells)
    while life.board.busy:
        assert ticks(db, life) == [1]
        live(life, 1)
    assert life.last_tick >= states
    assert not life.saved.state.learner.params.equal(parameters)
    assert ticks(db, life) == [1]
    row = store.read_snapshot(db, life.claim.run_id, 1)
    assert row is not None
    whole = b"".join(life.board._states.policy(parameters, at, states) for at in range(states))
    assert unpack(row.blob, row.states)["policy"] == whole


def test_a_checkpoint_amid_a_snapshot_has_its_counts(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    small_portions(monkeypatch)
    life = begin(db, "unsafe-exploration")
    moves = live(life, 4)
    for _ in range(3):
        moves += live(life, 2)
        life.save()
    assert life.board.busy
    live(life, 1)
    again = RunSession(db, life.claim, life.run, lambda: None)
    assert again.last_tick == 10
    assert again.board._counts["visits"].sum() == moves
    alone = BoardSnapshot.stage == COUNTS_ALONE
    with db.read() as session:
        assert session.query(BoardSnapshot).where(alone).count() == store.COUNTS_KEPT


def test_an_agent_that_waits_goes_on_with_its_snapshot_and_ends_with_a_whole_one(
    db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    small_portions(monkeypatch)
    life = begin(db, "unsafe-exploration")
    seen = watch(db, [life.claim.run_id])[life.claim.run_id]
    assert life.board.next_portion() == math.inf
    life.report_waiting(seen)
    assert life.board.busy
    assert life.rests_until() < math.inf
    while life.board.busy:
        life.report_waiting(seen)
    assert ticks(db, life) == [0]
    assert life.rests_until() == math.inf
    monkeypatch.setattr(writer, "LAST_SECONDS", math.inf)
    live(life, 3)
    life.save(last=True)
    assert ticks(db, life) == [0, 3]


def test_a_life_of_before_snapshots_has_one_as_soon_as_it_is_taken_up(db: Database) -> None:
    life = begin(db, "unsafe-exploration")
    live(life, 12)
    life.save()
    with db.write() as session:
        session.execute(delete(BoardSnapshot))
        session.execute(delete(BoardStates))
    again = RunSession(db, life.claim, life.run, lambda: None)
    again.report_waiting(watch(db, [again.claim.run_id])[again.claim.run_id])
    assert ticks(db, again) == [12]


@pytest.mark.parametrize("table", [BoardSnapshot, BoardStates])
def test_damaged_numbers_end_no_life(db: Database, table: type[BoardSnapshot | BoardStates]) -> None:
    life = begin(db, "reward-hacking")
    live(life, 12)
    life.save()
    with db.write() as session:
        session.execute(update(table).values(blob=b"not compressed"))
    again = RunSession(db, life.claim, life.run, lambda: None)
    moves = live(again, 3)
    again.save()
    row = store.read_snapshot(db, life.claim.run_id, 15)
    stored = store.read_states(db, life.claim.run_id)
    assert row is not None
    assert stored is not None
    visits = memoryview(unpack(row.blob, row.states)["visits"]).cast("I")
    assert (sum(visits), row.states) == (moves, len(stored[0]["cells"]))


def test_all_that_is_stored_of_a_board_stays_within_its_bytes(
    db: Database, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Snapshots make room for the states, and for the policies of earlier stages."""
    monkeypatch.setattr(store, "MOST_BYTES", 30_000)
    draw = random.Random(1)
    cells = [[row, draw.randrange(1_000), 0] for row in range(2_000)]
    board: store.Stored = {"rests": [{"ground": ["#"], "box": None, "parts": {}}], "cells": cells}
    for tick in range(1, 60):
        rows = [Numbers(tick, 2, 0, 0.9, 2_000, draw.randbytes(1_000))]
        rows += [Numbers(tick, 1, 0, 0.9, 2_000, draw.randbytes(2_000), frozen=True)]
        store.write(db, mine, board if tick == 1 else None, False, rows, None)
    with db.read() as session:
        states = len(session.get_one(BoardStates, mine.run_id).blob)
        sizes = session.scalars(select(BoardSnapshot.size)).all()
    assert states > 3_000
    assert 28_000 < sum(sizes) + states <= 30_000
    assert ticks_of(db, mine.run_id)[-1] == 59


def test_a_first_snapshot_is_stored_from_its_first_portion_on(
    db: Database, client: httpx2.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also after a worker that died amid it; the next snapshots are stored whole."""
    small_portions(monkeypatch)
    monkeypatch.setattr(writer, "SHARE", math.inf)
    life = begin(db, "unsafe-exploration")
    number = life.claim.run_id

    def told() -> tuple[bool, int]:
        found = client.get(f"/api/v1/runs/{number}/board/{life.last_tick}").json()
        policy = base64.b64decode(found["policy"])
        rows = [any(policy[at : at + 4]) for at in range(0, len(policy), 4)]
        assert (sum(rows), len(rows)) == (found["known"], found["states"])
        return found["partial"], found["known"]

    live(life, 1)
    assert told() == (True, 1)
    life.save()
    again = RunSession(db, life.claim, life.run, lambda: None)
    seen = watch(db, [number])[number]
    for _ in range(8):
        again.report_waiting(seen)
    assert told() == (True, 8)
    while again.board.busy:
        again.report_waiting(seen)
    partial, known = told()
    assert (partial, known) == (False, len(again.board._states.cells))
    assert ticks(db, again) == [1]
    while not again.board.busy:
        live(again, 1)
    assert ticks(db, again) == [1]


@pytest.mark.parametrize("ends", ["finished", "stopped"])
def test_a_life_that_ends_before_its_first_snapshot_is_whole_completes_it_between_other_turns(
    db: Database, client: httpx2.Client, monkeypatch: pytest.MonkeyPatch, ends: str
) -> None:
    small_portions(monkeypatch)
    monkeypatch.setattr(writer, "LAST_SECONDS", 0.0)
    life = begin(db, "unsafe-exploration")
    number = life.claim.run_id
    live(life, 2)
    held = HeldRuns(db, Patience(), lambda run: None)
    held.claims[number], held.sessions[number] = life.claim, life
    if ends == "finished":
        monkeypatch.setattr(life, "finished", lambda: True)
    else:
        runs.set_status(db, number, RunStatus.STOPPED)
    turns = 0
    while held.claims:
        held.turn(number, watch(db, [number])[number])
        turns += 1
    assert turns > len(life.board._states.cells) // 2  # a portion in each turn
    found = client.get(f"/api/v1/runs/{number}/board/1").json()
    assert (found["partial"], found["known"]) == (False, found["states"])
