"""Weights and answers that runs begin with, in the database, where a worker finds them on any machine."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from datetime import datetime, timedelta
from pathlib import Path

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from parenting.server.columns import Damaged
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.origins import stored_hashes
from parenting.server.tables import Run, Weights
from parenting.weights.store import SUFFIX, NoWeightsError, Wanted, digest, find

OF_A_SIZE = re.compile(r".+-\d+x\d+-v\d+\.safetensors")
"""The name of pre-trained weights that every later run on levels of their size begins with, too."""
INHERITED = " (inherited)"
"""The end of the name of a policy or of answers; pre-trained weights are found by theirs, without it."""
YOUNG = timedelta(hours=1)
"""Rows as young as this are left alone: the runs that begin with them may be about to be stored."""


def put(db: Database, file: Path) -> str:
    """Store a file of weights, once, and return its SHA-256."""
    return put_bytes(db, file.name, file.read_bytes())


def put_bytes(
    db: Database, name: str, blob: bytes, fence: Callable[[Session], None] = lambda session: None
) -> str:
    """Store what a run begins with under its SHA-256, once, and return that.

    A `fence` is called first in the same transaction: it raises where the one who writes may not any more.
    """
    sha256 = digest(blob)
    with db.write() as session:
        fence(session)
        put_in(session, sha256, name, blob, db.clock())
    return sha256


def put_in(session: Session, sha256: str, name: str, blob: bytes, now: datetime) -> None:
    """Store bytes within a transaction, once; until its end nobody removes them as unused."""
    same = select(Weights.sha256).where(Weights.sha256 == sha256).with_for_update()
    if session.scalar(same) is None:
        session.add(Weights(sha256=sha256, name=name, blob=blob, created=now))
    elif not OF_A_SIZE.fullmatch(name):  # what is uploaded again is kept as long as if it were new
        session.execute(update(Weights).where(Weights.sha256 == sha256).values(created=now))


def remove_unused(session: Session, hashes: Collection[str]) -> int:
    """Delete those of these policies, answers and weights that no run begins with; return how many.

    Pre-trained weights of a world and a size stay for later runs. Where an origin is damaged, nobody knows
    what its run began with, so nothing is deleted.
    """
    rows = select(Weights.sha256, Weights.name).where(Weights.sha256.in_(hashes)).with_for_update()
    found = {sha256 for sha256, name in session.execute(rows) if not OF_A_SIZE.fullmatch(name)}
    if not found:
        return 0
    used = set(session.scalars(select(Run.weights).where(Run.weights.in_(found))))
    for origin in session.scalars(select(Run.origin).where(Run.origin.is_not(None))):
        if isinstance(origin, Damaged):
            return 0
        used |= stored_hashes(origin)
    session.execute(delete(Weights).where(Weights.sha256.in_(found - used)))
    return len(found - used)


def sweep(db: Database) -> int:
    """Delete rows that deleted runs left behind, as versions up to 0.5 did; return their number."""
    with db.read() as session:
        rows = session.execute(select(Weights.sha256, Weights.name, Weights.created)).all()
    until = db.clock() - YOUNG
    old = [
        row.sha256
        for row in rows
        if isinstance(row.created, datetime) and row.created < until and not OF_A_SIZE.fullmatch(row.name)
    ]
    if not old:
        return 0
    with db.write(durable=False) as session:
        return remove_unused(session, old)


def needed(wanted: Wanted, folder: Path | None, db: Database | None) -> Path | str:
    """Return the file of pre-trained weights, or the SHA-256 of those that are stored.

    Raises:
        NoWeightsError: there are none.
    """
    try:
        return find(wanted, folder)
    except NoWeightsError:
        kept = None if db is None else _newest(db, f"{wanted.name}{SUFFIX}")
        if kept is None:
            raise
        return kept


def _newest(db: Database, name: str) -> str | None:
    with db.read() as session:
        rows = select(Weights.sha256).where(Weights.name == name)
        return session.scalars(rows.order_by(Weights.created.desc(), Weights.sha256).limit(1)).first()


def get(db: Database, sha256: str, what: str = "pre-trained weights") -> bytes:
    """Return the bytes of stored weights, or of something else that runs begin with.

    Raises:
        NotFound: no weights have this hash, or they have changed.
    """
    with db.read() as session:
        row = session.get(Weights, sha256)
        blob = None if row is None else row.blob
    if blob is None or digest(blob) != sha256:
        raise NotFound(f"The {what} {sha256} are not in the database, or are damaged.")
    return blob
