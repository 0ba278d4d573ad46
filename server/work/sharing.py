"""Fair shares: each living worker raises as many runs as the others, rounded up."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import func, select

from parenting.server.db import Database
from parenting.server.statuses import LIVING
from parenting.server.tables import Run
from parenting.server.workers import alive


def share(db: Database, worker: str, seconds: float) -> int:
    """Return how many runs a worker may raise: the living ones by the living workers, rounded up.

    A worker counts as living for `seconds` after its last sign, as long as a claim holds; so what a dead one
    raised is shared out when its claims lapse.
    """
    with db.read() as session:
        number: int = session.execute(_LIVING).scalar_one()
    workers = len({worker, *alive(db, seconds)})
    return -(-number // workers)


def surplus(run_ids: Sequence[int], most: int) -> Sequence[int]:
    """Return the runs to give up so that `most` are left, taken evenly from the whole order.

    With busy runs before idle ones, another worker so gets its share of both.
    """
    extra = max(0, len(run_ids) - most)
    return [run_ids[place * len(run_ids) // extra] for place in range(extra)]


_LIVING = select(func.count()).where(Run.status.in_(LIVING))
