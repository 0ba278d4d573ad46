"""Checkpoints in the database: save one, load the last two. Their bytes are made by `server.snapshot`.

A large one is written in parts (`server.checkpoint_parts`), and exists once its row does.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

from sqlalchemy import ColumnElement, Select, bindparam, delete, func, select
from sqlalchemy.orm import Session

from parenting.server import checkpoint_parts
from parenting.server.checkpoint_parts import join_parts, sweep_parts, write_parts
from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.runs import CLAIM_SECONDS, Claim, held, silent
from parenting.server.statuses import RunStatus
from parenting.server.tables import Checkpoint, CheckpointPart, Run

KEPT = 2
"""Checkpoints kept of a run: the last, and one before it in case the last is damaged. Of a run that was
stopped or has finished the last alone is kept (`thin`); one that has failed keeps both, since it may have
failed for what is in the last."""


@dataclass(frozen=True)
class StoredCheckpoint:
    """A stored checkpoint; `intact` is true if its bytes are those that were written."""

    tick: int
    blob: bytes
    sha256: str  # of the bytes that were written
    intact: bool


Also = Callable[[Session, Run, int], None]
"""Does more in the transaction that stores a checkpoint, of the run, locked, and the checkpoint's number."""


def save_checkpoint(db: Database, mine: Claim, tick: int, blob: bytes, also: Also | None = None) -> None:
    """Store the state after a tick, with its hash, and delete all but the last two.

    A second checkpoint of the same tick replaces the first, and those of later ticks: they were passed over.
    What is done `also` is done with it or not at all, and is durable.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    digest = hashlib.sha256(blob).hexdigest()
    if len(blob) <= checkpoint_parts.PART_BYTES:
        _store(db, mine, Checkpoint(tick=tick, blob=blob, sha256=digest), also)
        return
    sweep_parts(db, mine)
    parcel = write_parts(db, mine, blob)
    _store(db, mine, Checkpoint(tick=tick, blob=b"", sha256=digest, parcel=parcel), also)
    sweep_parts(db, mine)


def _store(db: Database, mine: Claim, row: Checkpoint, also: Also | None) -> None:
    with db.write(durable=also is not None) as session:
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
        if also is not None:
            also(session, run, row.id)


def ended_with_more(db: Database, seconds: float = CLAIM_SECONDS, but: Collection[int] = ()) -> int | None:
    """Return a run that was stopped or has finished, has several checkpoints, and is held by no worker.

    `but` names runs to leave alone.
    """
    with db.read() as session:
        return session.scalar(_several(seconds), {"but": list(but), **db.mark(session).bound()})


@cache
def _several(seconds: float) -> Select[int]:
    """Return the statement of `ended_with_more`, which a worker asks twice a second."""
    several = select(Checkpoint.run_id).join(Run, Run.id == Checkpoint.run_id).where(*_ended(seconds))
    several = several.where(Run.id.not_in(bindparam("but", expanding=True)))
    return several.group_by(Checkpoint.run_id).having(func.count() > 1).limit(1)


def thin(db: Database, run_id: int, seconds: float = CLAIM_SECONDS) -> bool:
    """Delete a piece of what is older than the last checkpoint of such a run; return whether there was one.

    Its parts go first, one by one, so that whoever goes on finds the rest. Where the last checkpoint is seen
    to be damaged, the ones before it are kept.
    """
    with db.write(durable=False) as session:
        mine = select(Run.id).where(Run.id == run_id, *_ended(seconds)).with_for_update()
        if session.scalar(mine, db.mark(session).bound()) is None:
            return False
        rows = select(Checkpoint.id, Checkpoint.parcel).where(Checkpoint.run_id == run_id)
        found = session.execute(rows.order_by(Checkpoint.id.desc())).all()
        if len(found) < 2 or not _whole(session, found[0].id):
            return False
        oldest = found[-1]
        part = session.scalar(
            select(CheckpointPart.id).where(CheckpointPart.parcel == oldest.parcel).limit(1)
        )
        if part is None:
            session.execute(delete(Checkpoint).where(Checkpoint.id == oldest.id))
        else:
            session.execute(delete(CheckpointPart).where(CheckpointPart.id == part))
        return True


def _ended(seconds: float) -> tuple[ColumnElement[bool], ...]:
    ended = Run.status.in_((RunStatus.STOPPED, RunStatus.FINISHED))
    return ended, Run.deleting.is_(None), silent(seconds)


def _whole(session: Session, checkpoint_id: int) -> bool:
    """Return whether a checkpoint of one piece has the bytes that were written; one of parts is trusted."""
    row = session.get_one(Checkpoint, checkpoint_id)
    return row.parcel is not None or _stored(session, row).intact


def load_checkpoints(db: Database, run_id: int) -> Sequence[StoredCheckpoint]:
    """Return the stored checkpoints, newest first."""
    return list(newest_first(db, run_id))


def newest_first(db: Database, run_id: int) -> Iterator[StoredCheckpoint]:
    """Yield the stored checkpoints, newest first; each is read when it is asked for.

    The caller takes the first one that is intact and can be read (`server.recall`), and the one before it has
    as many bytes.
    """
    last: int | None = None
    while True:
        with db.read() as session:
            found = _newest_before(session, run_id, last)
        if found is None:
            return
        last, stored = found
        yield stored


def stored_in(session: Session, run_id: int) -> Iterator[StoredCheckpoint]:
    """Yield what `newest_first` does, in an open transaction."""
    last: int | None = None
    while (found := _newest_before(session, run_id, last)) is not None:
        last, stored = found
        yield stored


def _newest_before(session: Session, run_id: int, last: int | None) -> tuple[int, StoredCheckpoint] | None:
    rows = select(Checkpoint).where(Checkpoint.run_id == run_id).order_by(Checkpoint.id.desc()).limit(1)
    row = session.scalars(rows if last is None else rows.where(Checkpoint.id < last)).first()
    return None if row is None else (row.id, _stored(session, row))


def _stored(session: Session, row: Checkpoint) -> StoredCheckpoint:
    blob, sha256 = sound(row, "blob") or b"", sound(row, "sha256") or ""
    tick, run_id, parcel = (sound(row, name) for name in ("tick", "run_id", "parcel"))
    if parcel is not None and run_id is not None:
        blob = join_parts(session, run_id, parcel)
    intact = tick is not None and hashlib.sha256(blob).hexdigest() == sha256
    return StoredCheckpoint(-1 if tick is None else tick, blob, sha256, intact)
