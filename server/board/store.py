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

from sqlalchemy import and_, bindparam, delete, func, insert, or_, select
from sqlalchemy.orm import Session, defer

from parenting.server.board_tables import BoardSnapshot, BoardStates
from parenting.server.columns import UNREADABLE, Damaged
from parenting.server.db import Database
from parenting.server.runs import Claim, held_status
from parenting.server.table_root import Table

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
        mine_only = {"run": mine.run_id}
        if after is not None:
            session.execute(_LATER, mine_only | {"after": after})
        if states is not None:
            session.execute(_STATES, mine_only)
            blob = zlib.compress(json.dumps(states).encode(), 6)
            count = len(states["cells"])
            row = {"run_id": mine.run_id, "states": count, "complete": complete, "blob": blob}
            session.execute(insert(_KNOWN), row)
        for one in found:
            _replace(session, mine.run_id, one)
        _thin(session, mine.run_id)


def _replace(session: Session, run_id: int, one: Numbers) -> None:
    here = {"run": run_id, "of_stage": one.stage}
    if one.frozen:
        older = session.execute(_FROZEN, here | {"but": one.tick}).scalars()
        kept = list(older)[: COUNTS_KEPT - 1] if one.stage == COUNTS_ALONE else []
        session.execute(_FROZEN_BEFORE, here | {"kept": kept})
    else:
        session.execute(_SAME, here | {"at": one.tick})
    session.execute(insert(_SNAPSHOT), {"run_id": run_id, "size": len(one.blob), **vars(one)})


def _thin(session: Session, run_id: int) -> None:
    rows = session.execute(_SIZES, {"run": run_id}).all()
    states = session.execute(_STATES_SIZE, {"run": run_id}).scalar() or 0
    beside = states + sum(row.size for row in rows if row.frozen is True)
    live = [(row.tick, row.size) for row in rows if row.frozen is False]
    dropped = to_drop(live, MOST_BYTES - beside)
    if dropped:
        session.execute(_THINNED, {"run": run_id, "ticks": dropped})


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


_SNAPSHOT, _KNOWN = (Table.metadata.tables[one.__tablename__] for one in (BoardSnapshot, BoardStates))
_OF_RUN = _SNAPSHOT.c.run_id == bindparam("run")
_OF_STAGE = and_(_OF_RUN, _SNAPSHOT.c.stage == bindparam("of_stage"))
_LATER = delete(_SNAPSHOT).where(_OF_RUN, _SNAPSHOT.c.tick > bindparam("after"))
_SAME = delete(_SNAPSHOT).where(_OF_STAGE, _SNAPSHOT.c.tick == bindparam("at"))
_FROZEN = select(_SNAPSHOT.c.tick).where(_OF_STAGE, _SNAPSHOT.c.frozen, _SNAPSHOT.c.tick != bindparam("but"))
_FROZEN = _FROZEN.order_by(_SNAPSHOT.c.tick.desc())
_FROZEN_BEFORE = delete(_SNAPSHOT).where(
    _OF_STAGE, _SNAPSHOT.c.frozen, _SNAPSHOT.c.tick.not_in(bindparam("kept", expanding=True))
)
_SIZES = select(_SNAPSHOT.c.tick, _SNAPSHOT.c.size, _SNAPSHOT.c.frozen).where(_OF_RUN)
_SIZES = _SIZES.order_by(_SNAPSHOT.c.tick)
_THINNED = delete(_SNAPSHOT).where(
    _OF_RUN, _SNAPSHOT.c.tick.in_(bindparam("ticks", expanding=True)), ~_SNAPSHOT.c.frozen
)
_STATES = delete(_KNOWN).where(_KNOWN.c.run_id == bindparam("run"))
_STATES_SIZE = select(func.length(_KNOWN.c.blob)).where(_KNOWN.c.run_id == bindparam("run"))
