"""Weights and answers that runs begin with, in the database, where a worker finds them on any machine."""

from __future__ import annotations

from pathlib import Path

from sqlalchemy import select

from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.tables import Weights
from parenting.weights.store import SUFFIX, NoWeightsError, Wanted, digest, find


def put(db: Database, file: Path) -> str:
    """Store a file of weights, once, and return its SHA-256."""
    return put_bytes(db, file.name, file.read_bytes())


def put_bytes(db: Database, name: str, blob: bytes) -> str:
    """Store what a run begins with under its SHA-256, once, and return that."""
    sha256 = digest(blob)
    with db.write() as session:
        if session.get(Weights, sha256) is None:
            session.add(Weights(sha256=sha256, name=name, blob=blob, created=db.clock()))
    return sha256


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
