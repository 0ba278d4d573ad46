"""Verbs on workers: signs of life, which /readyz and health checks ask for. One transaction each."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import timedelta

from sqlalchemy import delete, select

from parenting.server.db import Database
from parenting.server.tables import Worker

SIGN_SECONDS = 2.0
"""How often a worker gives a sign of life."""
SILENT_SECONDS = 10.0
"""After so long without one it does not count as alive: some ticks, such as a first look at a large level,
take seconds."""


def sign(db: Database, name: str) -> None:
    """A sign of life of a worker. Rows of workers that were killed a day ago are removed."""
    with db.write() as session:
        now = db.clock()
        session.execute(delete(Worker).where(Worker.heartbeat < now - timedelta(days=1)))
        row = session.get(Worker, name)
        if row is None:
            session.add(Worker(name=name, started=now, heartbeat=now))
        else:
            row.heartbeat = now


def sign_off(db: Database, name: str) -> None:
    """A worker ends in order."""
    with db.write() as session:
        session.execute(delete(Worker).where(Worker.name == name))


def alive(db: Database, seconds: float = SILENT_SECONDS) -> Sequence[str]:
    """The names of the workers that gave a sign of life within `seconds`, in their order."""
    with db.read() as session:
        since = db.clock() - timedelta(seconds=seconds)
        rows = select(Worker.name).where(Worker.heartbeat >= since)
        return session.scalars(rows.order_by(Worker.name)).all()
