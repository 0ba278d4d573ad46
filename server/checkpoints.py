"""Checkpoints in the database: save one, load the last two. Their bytes are made by `server.snapshot`."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import delete, select

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
    intact: bool


def save_checkpoint(db: Database, mine: Claim, tick: int, blob: bytes) -> None:
    """Store the state after a tick, with its hash, and delete all but the last two.

    A second checkpoint of the same tick replaces the first.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    digest = hashlib.sha256(blob).hexdigest()
    with db.write(durable=False) as session:
        run = held(session, mine)
        session.execute(delete(Checkpoint).where(Checkpoint.run_id == run.id, Checkpoint.tick == tick))
        session.add(Checkpoint(run_id=run.id, tick=tick, blob=blob, sha256=digest, created=db.clock()))
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

    The caller takes the first intact one, and logs each damaged one that it passes over.
    """
    with db.read() as session:
        rows = session.scalars(
            select(Checkpoint).where(Checkpoint.run_id == run_id).order_by(Checkpoint.id.desc())
        ).all()
        return [
            StoredCheckpoint(row.tick, row.blob, hashlib.sha256(row.blob).hexdigest() == row.sha256)
            for row in rows
        ]
