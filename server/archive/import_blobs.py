"""Put the bytes of an imported run into the database: its checkpoint, its moves, and what it began with."""

from __future__ import annotations

import hashlib
import secrets
import zlib
from datetime import datetime

from sqlalchemy.orm import Session

from parenting.server.archive.manifest import RunEntry
from parenting.server.archive.source import Source
from parenting.server.checkpoint_parts import PART_BYTES
from parenting.server.errors import SetupError
from parenting.server.moves import PART
from parenting.server.origins import stored_hashes
from parenting.server.tables import Checkpoint, CheckpointPart, Moves, Run
from parenting.server.weights import INHERITED, put_in


def put_blobs(session: Session, now: datetime, found: Source, entry: RunEntry, run: Run) -> None:
    """Store the bytes of a run.

    Raises:
        SetupError: a policy or answers that it began with are missing in the export.
    """
    for sha256 in sorted({one for one in (run.weights, *stored_hashes(run.origin)) if one}):
        name = entry.weights.get(sha256)
        blob = None if name is None else found.blob(name)
        if blob is None or hashlib.sha256(blob).hexdigest() != sha256:
            raise SetupError(
                f"The export lacks the weights {sha256}, with which run {entry.number} began. "
                "Nothing was imported."
            )
        put_in(session, sha256, f"imported{INHERITED}", blob, now)
    if entry.checkpoint is not None:
        _checkpoint(session, now, found.blob(entry.checkpoint.file), entry.checkpoint.tick, run.id)
    if entry.moves is not None:
        _moves(session, found.blob(entry.moves), run.id)


def _checkpoint(session: Session, now: datetime, blob: bytes, tick: int, run_id: int) -> None:
    row = Checkpoint(
        run_id=run_id, tick=tick, blob=blob, sha256=hashlib.sha256(blob).hexdigest(), created=now
    )
    if len(blob) > PART_BYTES:
        row.blob, row.parcel = b"", secrets.token_hex(8)
        for place, begin in enumerate(range(0, len(blob), PART_BYTES)):
            part = blob[begin : begin + PART_BYTES]
            session.add(CheckpointPart(run_id=run_id, parcel=row.parcel, place=place, blob=part))
            session.flush()
    session.add(row)
    session.flush()


def _moves(session: Session, moves: bytes, run_id: int) -> None:
    for part, begin in enumerate(range(0, len(moves), PART)):
        blob = zlib.compress(moves[begin : begin + PART], 1)
        session.add(Moves(run_id=run_id, part=part, blob=blob))
    session.flush()
