"""Signs of life of workers, which /readyz and health checks read. Each verb is one transaction."""

from __future__ import annotations

import secrets
import socket
from collections.abc import Collection, Sequence
from typing import NamedTuple

from sqlalchemy import bindparam, delete, insert, select, update

from parenting.server.db import Database
from parenting.server.store.clock import Mark, holds, is_over
from parenting.server.tables import Table, Worker

SIGN_SECONDS = 2.0
"""Seconds between two signs of life of a worker."""
DAY = 24 * 3600.0
SILENT_SECONDS = 10.0
"""A worker counts as alive for this long after a sign of life. Some ticks take seconds, such as the first
evaluation of a large level."""


def new_name(pid: int) -> str:
    """Return a name for a worker that is a process of this machine, which no other worker has.

    Containers may have equal host names and process ids. Two workers of one name would take each other's
    claims for their own that they do not know, and give them back.
    """
    return f"{socket.gethostname()}:{pid}:{secrets.token_hex(2)}"


def is_here(name: str, pid: int | None = None) -> bool:
    """Return whether a worker is a process of a machine of this name, and has this process id."""
    host, _, rest = name.partition(":")
    return host == socket.gethostname() and (pid is None or rest.partition(":")[0] == str(pid))


class Figures(NamedTuple):
    """The figures that a worker tells of itself with each sign of life."""

    runs: int | None = None
    """The runs that it raises."""
    lives: int | None = None
    """Those of them whose life is in its memory."""
    busy: float | None = None
    """Processor seconds a second since the last sign: 1 is a whole core."""
    memory: int | None = None
    """Its resident bytes."""
    waited: float | None = None
    """Seconds that a turn which was due has waited since the last sign, at the most."""


NO_FIGURES = Figures()


def sign(db: Database, name: str, figures: Figures = NO_FIGURES) -> None:
    """Give a sign of life of a worker, and so of all that it raises (`runs.silent`).

    The first sign of each removes the rows of workers that were silent for a day.
    """
    with db.write_unseen() as session:
        now, mark = db.clock(), db.mark(session)
        found = {"heartbeat": now, "epoch": mark.epoch, "mark": mark.seconds, **figures._asdict()}
        if session.execute(_SIGN, {"worker": name, **found}).rowcount:  # type: ignore[attr-defined]
            return
        session.execute(delete(_WORKER).where(_GONE), mark.bound())
        session.execute(insert(_WORKER), {"name": name, "started": now, **found})


def sign_off(db: Database, name: str) -> None:
    """Remove a worker that ends in order."""
    with db.write() as session:
        session.execute(delete(Worker).where(Worker.name == name))


def alive(db: Database, seconds: float = SILENT_SECONDS) -> Sequence[str]:
    """Return the names of the workers that gave a sign of life within `seconds`, sorted."""
    with db.read() as session:
        rows = select(Worker.name).where(holds(Worker.epoch, Worker.mark, Worker.mark + seconds))
        return session.scalars(rows.order_by(Worker.name), db.mark(session).bound()).all()


def living(db: Database, seconds: float = SILENT_SECONDS) -> Sequence[Worker]:
    """Return the workers that gave a sign of life within `seconds`, by name."""
    with db.read() as session:
        rows = select(Worker).where(holds(Worker.epoch, Worker.mark, Worker.mark + seconds))
        return session.scalars(rows.order_by(Worker.name), db.mark(session).bound()).all()


def last_signs(db: Database, names: Collection[str]) -> dict[str, Mark]:
    """Return when each of these workers gave its last sign of life."""
    if not names:
        return {}
    rows = select(Worker.name, Worker.epoch, Worker.mark).where(Worker.name.in_(names))
    with db.read() as session:
        found = session.execute(rows).all()
    sound = [row for row in found if isinstance(row.epoch, str) and isinstance(row.mark, float)]
    return {row.name: Mark(row.epoch, row.mark) for row in sound}


_WORKER = Table.metadata.tables[Worker.__tablename__]
_GONE = is_over(_WORKER.c.epoch, _WORKER.c.mark, _WORKER.c.mark + DAY)
_SIGN = update(_WORKER).where(_WORKER.c.name == bindparam("worker"))
_SIGN = _SIGN.values({name: bindparam(name) for name in ("heartbeat", "epoch", "mark", *Figures._fields)})
