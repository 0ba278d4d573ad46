"""Checkpoints in the database: save one, load the last two. Their bytes are made by `server.snapshot`.

A large one is written in parts (`server.checkpoint_parts`), and exists once its row does.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from parenting.server import checkpoint_parts
from parenting.server.checkpoint_parts import join_parts, sweep_parts, write_parts
from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.runs import Claim, held
from parenting.server.tables import Checkpoint

KEPT = 2
"""Checkpoints kept of a run: the last, and one before it in case the last is damaged."""


@dataclass(frozen=True)
class StoredCheckpoint:
    """A stored checkpoint; `intact` is true if its bytes are those that were written."""

    tick: int
    blob: bytes
    sha256: str  # of the bytes that were written
    intact: bool


def save_checkpoint(db: Database, mine: Claim, tick: int, blob: bytes) -> None:
    """Store the state after a tick, with its hash, and delete all but the last two.

    A second checkpoint of the same tick replaces the first, and those of later ticks: they were passed over.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    digest = hashlib.sha256(blob).hexdigest()
    if len(blob) <= checkpoint_parts.PART_BYTES:
        _store(db, mine, Checkpoint(tick=tick, blob=blob, sha256=digest))
        return
    sweep_parts(db, mine)
    parcel = write_parts(db, mine, blob)
    _store(db, mine, Checkpoint(tick=tick, blob=b"", sha256=digest, parcel=parcel))
    sweep_parts(db, mine)


def _store(db: Database, mine: Claim, row: Checkpoint) -> None:
    with db.write(durable=False) as session:
        run = held(session, mine)
        later = delete(Checkpoint).where(Checkpoint.run_id == run.id, Checkpoint.tick >= row.tick)
        session.execute(later)
        row.run_id, row.created = run.id, db.clock()
        session.add(row)
        session.flush()
        newest = (
            select(Checkpoint.id)
            .where(Checkpoint.run_id == run.id)
            .order_by(Checkpoint.id.desc())
            .limit(KEPT)
        )
        kept = session.scalars(newest).all()
        session.execute(delete(Checkpoint).where(Checkpoint.run_id == run.id, Checkpoint.id.not_in(kept)))


def load_checkpoints(db: Database, run_id: int) -> Sequence[StoredCheckpoint]:
    """Return the stored checkpoints, newest first.

    The caller takes the first one that is intact and can be read (`server.recall`).
    """
    rows = select(Checkpoint).where(Checkpoint.run_id == run_id).order_by(Checkpoint.id.desc())
    with db.read() as session:
        return [_stored(session, row) for row in session.scalars(rows)]


def _stored(session: Session, row: Checkpoint) -> StoredCheckpoint:
    blob, sha256 = sound(row, "blob") or b"", sound(row, "sha256") or ""
    tick, run_id, parcel = (sound(row, name) for name in ("tick", "run_id", "parcel"))
    if parcel is not None and run_id is not None:
        blob = join_parts(session, run_id, parcel)
    intact = tick is not None and hashlib.sha256(blob).hexdigest() == sha256
    return StoredCheckpoint(-1 if tick is None else tick, blob, sha256, intact)
