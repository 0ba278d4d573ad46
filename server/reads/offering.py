"""Look at runs whose next question somebody waits for and that nobody follows: which ones offer one."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import and_, bindparam, case, func, select, type_coerce
from sqlalchemy.orm import Session
from sqlalchemy.types import NullType

from parenting.server.statuses import QueryStatus
from parenting.server.store.clock import Mark, holds
from parenting.server.tables import Table


@dataclass(frozen=True)
class Offer:
    """One look at a run. Two of them are equal where the same questions can be leased."""

    state: tuple[Any, ...]
    """The run's status, goal and answers, and sums that tell one set of questions from another."""
    free: int
    """Open questions that nobody holds."""


def offers(session: Session, run_ids: Sequence[int], mark: Mark) -> tuple[dict[int, Offer], float]:
    """Return what runs offer, without those that are not there, and when the first of their leases ends.

    The end is one of the monotonic clock, and infinite where nobody holds a question.
    """
    rows = session.execute(_OFFERS, {"runs": list(run_ids), **mark.bound()}).all()
    ends = [row.ends for row in rows if isinstance(row.ends, float)]
    left = min(ends, default=float("inf")) - mark.seconds
    return {row[0]: Offer(tuple(row)[1:-1], row.open - row.held) for row in rows}, time.monotonic() + left


# Plain values: the types that tell damaged ones from sound ones would take longer than the store itself.
_PLAIN: Any = NullType()
_RUN, _QUERY = (Table.metadata.tables[name].c for name in ("run", "query"))
_HELD = holds(_QUERY.lease_epoch, _QUERY.lease_begin, _QUERY.lease_end)
_OFFERS = (
    select(
        *(type_coerce(_RUN[name], _PLAIN) for name in ("id", "status", "goal", "answers", "retracted")),
        func.count(_QUERY.id).label("open"),
        func.sum(_QUERY.id, type_=_PLAIN),
        func.max(_QUERY.id, type_=_PLAIN),
        func.count(case((_QUERY.put_back, 1))),
        func.count(case((_HELD, 1))).label("held"),
        func.sum(case((_HELD, _QUERY.id)), type_=_PLAIN),
        func.min(case((_HELD, _QUERY.lease_end)), type_=_PLAIN).label("ends"),
    )
    .select_from(Table.metadata.tables["run"])
    .outerjoin(
        Table.metadata.tables["query"], and_(_QUERY.run_id == _RUN.id, _QUERY.status == QueryStatus.OPEN)
    )
    .where(_RUN.id.in_(bindparam("runs", expanding=True)), _RUN.deleting.is_(None))
    .group_by(_RUN.id)
)
