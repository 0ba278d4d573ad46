"""The rows of snapshots: write one, thin them out, read them. Torch-free.

Dense at first and lately: a snapshot is dropped where its neighbours are near each other, measured by how far
they are from the beginning or from the newest. The last ones always stay, because a run that is taken up from
a checkpoint goes on counting from the snapshot of its tick.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypedDict

from sqlalchemy import ColumnElement, and_, delete, func, or_, select
from sqlalchemy.orm import Session, defer

from parenting.server.board_tables import BoardSnapshot, BoardStates
from parenting.server.columns import UNREADABLE, Damaged
from parenting.server.db import Database
from parenting.server.runs import Claim, held_status

MOST_BYTES = 2_000_000
"""Bytes of all snapshots of a run, its states included."""
MOST_SNAPSHOTS = 240
LATEST = 8
"""The last snapshots, which are never dropped."""
COUNTS_ALONE, COUNTS_KEPT = 0, 2
"""The stage of rows with counts alone, for who takes the run up; so many are kept, as checkpoints are."""


class Stored(TypedDict):
    """The states of a run: boards, and for each state the agent's cell and its board's number."""

    rests: list[dict[str, Any]]
    cells: list[list[int]]


@dataclass(frozen=True)
class Numbers:
    """A snapshot as it is written."""

    tick: int
    stage: int
    answers: int
    p_guid: float
    states: int
    blob: bytes
    frozen: bool = False


def write(
    db: Database,
    mine: Claim,
    states: Stored | None,
    complete: bool,
    found: Sequence[Numbers],
    after: int | None,
) -> None:
    """Store snapshots, and the states where there are new ones.

    Args:
        db: The database.
        mine: The worker's claim.
        states: All states, if some were added since they were stored.
        complete: Whether they are all that can be reached.
        found: The snapshots.
        after: Delete those of later ticks first, which are lived again.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    with db.write(durable=False) as session:
        held_status(session, mine)
        run_id = mine.run_id
        if after is not None:
            later = delete(BoardSnapshot).where(BoardSnapshot.run_id == run_id, BoardSnapshot.tick > after)
            session.execute(later)
        if states is not None:
            session.execute(delete(BoardStates).where(BoardStates.run_id == run_id))
            blob = zlib.compress(json.dumps(states).encode(), 6)
            count = len(states["cells"])
            session.add(BoardStates(run_id=run_id, states=count, complete=complete, blob=blob))
        for one in found:
            _replace(session, run_id, one)
        session.flush()
        _thin(session, run_id)


def _replace(session: Session, run_id: int, one: Numbers) -> None:
    mine = BoardSnapshot.run_id == run_id, BoardSnapshot.stage == one.stage
    at: ColumnElement[bool] = BoardSnapshot.tick == one.tick
    if one.frozen:
        older = select(BoardSnapshot.tick).where(*mine, BoardSnapshot.frozen, BoardSnapshot.tick != one.tick)
        newest = older.order_by(BoardSnapshot.tick.desc()).limit(COUNTS_KEPT - 1)
        kept = session.scalars(newest).all() if one.stage == COUNTS_ALONE else ()
        at = and_(BoardSnapshot.frozen, BoardSnapshot.tick.not_in(kept))
    session.execute(delete(BoardSnapshot).where(*mine, at))
    session.add(BoardSnapshot(run_id=run_id, size=len(one.blob), **vars(one)))


def _thin(session: Session, run_id: int) -> None:
    rows = session.execute(
        select(BoardSnapshot.tick, BoardSnapshot.size)
        .where(BoardSnapshot.run_id == run_id, ~BoardSnapshot.frozen)
        .order_by(BoardSnapshot.tick)
    ).all()
    size = select(BoardSnapshot.size).where(BoardSnapshot.run_id == run_id, BoardSnapshot.frozen)
    states = select(func.length(BoardStates.blob)).where(BoardStates.run_id == run_id)
    beside = sum(session.scalars(size)) + (session.scalar(states) or 0)
    dropped = to_drop([(row.tick, row.size) for row in rows], MOST_BYTES - beside)
    if dropped:
        mine = BoardSnapshot.run_id == run_id, BoardSnapshot.tick.in_(dropped), ~BoardSnapshot.frozen
        session.execute(delete(BoardSnapshot).where(*mine))


def to_drop(rows: Sequence[tuple[int, int]], most_bytes: int) -> list[int]:
    """Return the ticks of the snapshots that have to go.

    Args:
        rows: Tick and bytes of each, in the order of ticks.
        most_bytes: What all of them may have.
    """
    kept, dropped = list(rows), []
    size = sum(one for _, one in kept)
    while (len(kept) > MOST_SNAPSHOTS or size > most_bytes) and len(kept) > LATEST + 1:
        newest = kept[-1][0]
        at = min(range(1, len(kept) - LATEST), key=lambda k: _loss(kept, k, newest), default=0)
        tick, less = kept.pop(at)
        dropped.append(tick)
        size -= less
    return dropped


def _loss(kept: Sequence[tuple[int, int]], at: int, newest: int) -> float:
    tick = kept[at][0]
    gap = kept[at + 1][0] - kept[at - 1][0]
    return gap / (1 + min(tick, newest - tick))


def read_states(db: Database, run_id: int) -> tuple[Stored, bool] | None:
    """Return the states of a run, and whether they are all; None if none are stored or they are damaged."""
    with db.read() as session:
        row = session.get(BoardStates, run_id)
        if row is None or isinstance(row.blob, Damaged):
            return None
        try:
            return json.loads(zlib.decompress(row.blob)), bool(row.complete)
        except (*UNREADABLE, zlib.error):
            return None


def list_snapshots(db: Database, run_id: int, after: int = -1) -> Sequence[BoardSnapshot]:
    """Return the snapshots after a tick without their numbers, in the order of ticks."""
    rows = (
        select(BoardSnapshot).options(defer(BoardSnapshot.blob, raiseload=True)).order_by(BoardSnapshot.tick)
    )
    rows = rows.where(BoardSnapshot.run_id == run_id, ~BoardSnapshot.frozen, BoardSnapshot.tick > after)
    with db.read() as session:
        return session.scalars(rows).all()


def read_snapshot(db: Database, run_id: int, tick: int) -> BoardSnapshot | None:
    """Return the last snapshot up to a tick, of the policy that acted then."""
    rows = select(BoardSnapshot).where(BoardSnapshot.run_id == run_id, BoardSnapshot.tick <= tick)
    newest = rows.where(~BoardSnapshot.frozen).order_by(BoardSnapshot.tick.desc()).limit(1)
    with db.read() as session:
        return session.scalars(newest).first()


def read_counts(db: Database, run_id: int, tick: int) -> BoardSnapshot | None:
    """Return the last row with counts up to a tick: a snapshot, or counts alone."""
    rows = select(BoardSnapshot).where(BoardSnapshot.run_id == run_id, BoardSnapshot.tick <= tick)
    counted = or_(~BoardSnapshot.frozen, BoardSnapshot.stage == COUNTS_ALONE)
    with db.read() as session:
        return session.scalars(rows.where(counted).order_by(BoardSnapshot.tick.desc()).limit(1)).first()


def read_frozen(db: Database, run_id: int, stage: int) -> BoardSnapshot | None:
    """Return the policy of an earlier stage, as it was frozen."""
    rows = select(BoardSnapshot).where(BoardSnapshot.run_id == run_id, BoardSnapshot.stage == stage)
    with db.read() as session:
        return session.scalars(rows.where(BoardSnapshot.frozen)).first()
