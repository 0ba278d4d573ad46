"""The ticks of a run that were lived already: what is recorded of them is not asked or heard again.

`server.queue.worker_side` says why.
"""

from __future__ import annotations

from sqlalchemy import BindParameter, bindparam, func, select
from sqlalchemy.orm import Session

from parenting.server.notes import AGENT_KINDS
from parenting.server.origins import rolled_back_to
from parenting.server.tables import Table

_NAMES = ("run", "query", "answer", "event")
_RUNS, _QUERY, _ANSWER, _EVENT = (Table.metadata.tables[name] for name in _NAMES)
_RUN: BindParameter[int] = bindparam("run_id")
_HIGH = select(
    select(func.max(_QUERY.c.tick)).where(_QUERY.c.run_id == _RUN).scalar_subquery(),
    select(func.max(_ANSWER.c.applied_tick)).where(_ANSWER.c.run_id == _RUN).scalar_subquery(),
    select(func.max(_EVENT.c.applied_tick))
    .where(_EVENT.c.run_id == _RUN, _EVENT.c.kind.in_(AGENT_KINDS))
    .scalar_subquery(),
    select(_RUNS.c.origin).where(_RUNS.c.id == _RUN).scalar_subquery(),
)


def high(session: Session, run_id: int) -> tuple[int, int, int]:
    """Return the largest tick of a query or of the copied record, of an applied answer, and of an event."""
    *found, origin = session.execute(_HIGH, {"run_id": run_id}).one()
    query, answer, event = (-1 if tick is None else tick for tick in found)
    return max(query, rolled_back_to(origin)), answer, event


def closed(session: Session, run_id: int, tick: int) -> bool:
    """Return whether a tick was lived already, so that nothing new is heard in it."""
    query, answer, event = high(session, run_id)
    return query >= tick or answer >= tick or event > tick
