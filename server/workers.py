"""Signs of life of workers, which /readyz and health checks read. Each verb is one transaction."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import delete, select

from parenting.server.db import Database
from parenting.server.store.clock import holds, is_over
from parenting.server.tables import Worker

SIGN_SECONDS = 2.0
"""Seconds between two signs of life of a worker."""
DAY = 24 * 3600.0
SILENT_SECONDS = 10.0
"""A worker counts as alive for this long after a sign of life. Some ticks take seconds, such as the first
evaluation of a large level."""


def sign(db: Database, name: str) -> None:
    """Give a sign of life of a worker. Rows of workers that were silent for a day are removed."""
    with db.write(durable=False) as session:
        now, mark = db.clock(), db.mark(session)
        gone = is_over(Worker.epoch, Worker.mark, Worker.mark + DAY)
        session.execute(delete(Worker).where(gone), mark.bound())
        row = session.get(Worker, name)
        if row is None:
            row = Worker(name=name, started=now)
            session.add(row)
        row.heartbeat, row.epoch, row.mark = now, mark.epoch, mark.seconds


def sign_off(db: Database, name: str) -> None:
    """Remove a worker that ends in order."""
    with db.write() as session:
        session.execute(delete(Worker).where(Worker.name == name))


def alive(db: Database, seconds: float = SILENT_SECONDS) -> Sequence[str]:
    """Return the names of the workers that gave a sign of life within `seconds`, sorted."""
    with db.read() as session:
        rows = select(Worker.name).where(holds(Worker.epoch, Worker.mark, Worker.mark + seconds))
        return session.scalars(rows.order_by(Worker.name), db.mark(session).bound()).all()
