"""Parts of large checkpoints: each is written by a short transaction, so that no other write waits long.

The database lets one transaction write at a time, and a checkpoint may have a hundred megabytes. Its parts
are therefore written one by one, with a rest after each in which others write, and belong to no checkpoint
until the last transaction stores the row that names them. A writer that was killed before leaves parts that
nobody names: the next one deletes them.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy import bindparam, delete, exists, select
from sqlalchemy.orm import Session

from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.runs import Claim, held
from parenting.server.tables import Checkpoint, CheckpointPart

PART_BYTES = 2**20
"""Bytes that one transaction writes of a checkpoint. A checkpoint of at most so many is one piece."""
REST, LONGEST_REST = 2.0, 0.25
"""After each part the writer rests for so many times as long as the part took, at most for some seconds.

Other processes wait for SQLite's lock by looking for it again after 1, 2, 5, 10 ... 100 ms. The lock is free
two thirds of the time, so that a look seldom fails, and five in a row hardly ever.
"""


def write_parts(db: Database, mine: Claim, blob: bytes) -> str:
    """Write the bytes of a checkpoint in parts, and return the name of their parcel.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    parcel = secrets.token_hex(8)
    for place, begin in enumerate(range(0, len(blob), PART_BYTES)):
        part = blob[begin : begin + PART_BYTES]
        with _short_write(db, mine) as session:
            session.add(CheckpointPart(run_id=mine.run_id, parcel=parcel, place=place, blob=part))
    return parcel


def join_parts(session: Session, run_id: int, parcel: str) -> bytes:
    """Return the bytes of a parcel; of a damaged part nothing, so that their hash tells the damage."""
    mine = CheckpointPart.run_id == run_id, CheckpointPart.parcel == parcel
    rows = session.scalars(select(CheckpointPart).where(*mine).order_by(CheckpointPart.place))
    return b"".join(sound(row, "blob") or b"" for row in rows)


def sweep_parts(db: Database, mine: Claim) -> None:
    """Delete the parts of a run that belong to no checkpoint: superseded ones, and those of killed writers.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    with db.read() as session:
        numbers = session.scalars(_ORPHANS, {"run_id": mine.run_id}).all()
    for number in numbers:
        with _short_write(db, mine) as session:
            session.execute(delete(CheckpointPart).where(CheckpointPart.id == number))


_ORPHANS = (
    select(CheckpointPart.id)
    .where(
        CheckpointPart.run_id == bindparam("run_id"),
        ~exists().where(Checkpoint.run_id == bindparam("run_id"), Checkpoint.parcel == CheckpointPart.parcel),
    )
    .order_by(CheckpointPart.id)
)


@contextmanager
def _short_write(db: Database, mine: Claim) -> Iterator[Session]:
    """Write while the claim holds, and then rest."""
    with db.write(durable=False) as session:
        held(session, mine)
        began = time.monotonic()  # from when the lock is held: the wait for it holds up nobody
        yield session
    time.sleep(min(LONGEST_REST, REST * (time.monotonic() - began)))
