"""Fair shares: each living worker raises as many runs as the others, rounded up."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from sqlalchemy import bindparam, exists, func, select

from parenting.server.db import Database
from parenting.server.runs import free
from parenting.server.statuses import LIVING
from parenting.server.store.clock import holds
from parenting.server.tables import Run, Worker


class Prospect(NamedTuple):
    """The runs that a worker may raise."""

    share: int
    """The living runs by the living workers, rounded up."""
    free: bool
    """True if there is a run that nobody raises."""


def prospect(db: Database, worker: str, seconds: float) -> Prospect:
    """Look at the runs and the other workers, in one statement: a worker that waits asks every few seconds.

    A worker counts as living for `seconds` after its last sign, as long as a claim holds; so what a dead one
    raised is shared out when its claims lapse. This takes no lock.
    """
    with db.read() as session:
        asked = {"worker": worker, "seconds": seconds, **db.mark(session).bound()}
        living, others, any_free = session.execute(_LOOK, asked).one()
    return Prospect(-(-living // (others + 1)), bool(any_free))


def surplus(run_ids: Sequence[int], most: int) -> Sequence[int]:
    """Return the runs to give up so that `most` are left, taken evenly from the whole order.

    With busy runs before idle ones, another worker so gets its share of both.
    """
    extra = max(0, len(run_ids) - most)
    return [run_ids[place * len(run_ids) // extra] for place in range(extra)]


_LIVING = select(func.count()).where(Run.status.in_(LIVING))
_OTHERS = select(func.count()).where(
    Worker.name != bindparam("worker"),
    holds(Worker.epoch, Worker.mark, Worker.mark + bindparam("seconds")),
)
_LOOK = select(
    _LIVING.scalar_subquery(), _OTHERS.scalar_subquery(), exists().where(free(bindparam("seconds")))
)
