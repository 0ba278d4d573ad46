"""The entry of a run in the manifest, and its bytes: checkpoint, moves, and what it began with."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from datetime import datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from parenting.server.archive.target import Files
from parenting.server.checkpoints import stored_in
from parenting.server.damage import sound
from parenting.server.export import iso_time
from parenting.server.moves import moves_in
from parenting.server.origins import stored_hashes
from parenting.server.rollback import SETTINGS
from parenting.server.tables import Answer, Run, Weights

STATE = (
    *("status", "reason", "tick", "waiting", "optimal", "maturity", "milestones", "lesson", "versions"),
    *("answers", "retracted", "skipped", "origin", "batch", "trial", "created", "name"),
)
"""Where a run is, beside its settings (`rollback.SETTINGS`)."""


def settings_of(run: Run) -> dict[str, Any]:
    """Return the columns of a run that an import needs; damaged ones are null."""
    found = {name: sound(run, name) for name in (*SETTINGS, *STATE)}
    return {name: iso_time(value) if isinstance(value, datetime) else value for name, value in found.items()}


def write_blobs(session: Session, run: Run, files: Files) -> dict[str, Any]:
    """Write the bytes that belong to a run, and return what its entry in the manifest says of them."""
    return {
        "checkpoint": _checkpoint(session, run, files),
        "moves": _moves(session, run, files),
        "weights": dict(_weights(session, run, files)),
    }


def _checkpoint(session: Session, run: Run, files: Files) -> dict[str, Any] | None:
    """Write the newest checkpoint whose bytes are those that were written."""
    for kept in stored_in(session, run.id):
        if kept.intact:
            name = f"checkpoints/{run.public_id}.pt"
            with files.open(name) as file:
                file.write(kept.blob)
            return {"file": name, "tick": kept.tick, "sha256": kept.sha256}
    return None


def _moves(session: Session, run: Run, files: Files) -> str | None:
    found = moves_in(session, run.id)
    if not found:
        return None
    name = f"moves/{run.public_id}.bin"
    with files.open(name) as file:
        file.write(found)
    return name


def _weights(session: Session, run: Run, files: Files) -> Iterator[tuple[str, str]]:
    """Write what the run began with, once in an export; what is damaged is left out."""
    for sha256 in sorted({one for one in (sound(run, "weights"), *stored_hashes(run.origin)) if one}):
        name = f"weights/{sha256}"
        if name not in files.written:
            row = session.scalars(select(Weights).where(Weights.sha256 == sha256)).one_or_none()
            blob = None if row is None else sound(row, "blob")
            if blob is None or hashlib.sha256(blob).hexdigest() != sha256:
                continue
            with files.open(name) as file:
                file.write(blob)
        yield sha256, name


def last_link(session: Session, run: Run) -> str | None:
    """Return the last link of a run's chain."""
    last = select(Answer.link).where(Answer.run_id == run.id).order_by(Answer.number.desc()).limit(1)
    found = session.scalar(last)
    return found if isinstance(found, str) else None
