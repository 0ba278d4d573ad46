"""What the pages need of the database beyond the API's verbs. All their SQL is here; one transaction each."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import timedelta

from sqlalchemy import BindParameter, bindparam, func, or_, select
from sqlalchemy.orm import aliased

from parenting.server.db import Database
from parenting.server.queue.parent_side import LEASE_SECONDS, guidance_first, rests
from parenting.server.runs import lock
from parenting.server.statuses import QueryStatus
from parenting.server.tables import Metric, Query, Run

_SHOWN: BindParameter[Sequence[int]] = bindparam("shown", expanding=True)
_other = aliased(Query)
_ANSWERS_TO_COME = (
    select(func.count())
    .where(_other.run_id == Run.id, _other.status == QueryStatus.OPEN, _other.id.in_(_SHOWN))
    .correlate(Run)
    .scalar_subquery()
)
_FREE = or_(
    Query.leased_until.is_(None),
    Query.leased_until <= bindparam("now"),
    Query.leased_by == bindparam("client_id"),
)
_AHEAD = (
    select(Query)
    .join(Run, Run.id == Query.run_id)
    .where(Run.id == bindparam("run_id"), Query.status == QueryStatus.OPEN, Query.id.not_in(_SHOWN), _FREE)
    .where(or_(Run.goal.is_(None), Run.answers + _ANSWERS_TO_COME < Run.goal))
    .order_by(guidance_first(), Query.tick)
    .limit(1)
)
_ANY_AHEAD = _AHEAD.with_only_columns(Query.id)


def lease_ahead(
    db: Database, run_id: int, client_id: str, shown: Sequence[int], seconds: float = LEASE_SECONDS
) -> Query | None:
    """The most urgent question besides those `shown`, held for this client too, so that nobody waits for it.

    None if there is none, or if the run's goal is reached once those shown are answered.

    Raises:
        NotFound: there is no such run.
    """
    now = db.clock()
    asks = {"run_id": run_id, "client_id": client_id, "shown": list(shown), "now": now}
    with db.read() as session:  # nothing to offer is the common case, and takes no lock
        if session.execute(_ANY_AHEAD, asks).first() is None:
            return None
    with db.write(durable=False) as session:
        lock(session, run_id)
        query = session.scalars(_AHEAD, asks).first()
        if query is not None:
            query.leased_by, query.leased_until = client_id, now + timedelta(seconds=seconds)
        return query


def may_lease(db: Database, run_id: int, client_id: str) -> bool:
    """Whether some open question is free, or held for this client already."""
    free = or_(Query.leased_until.is_(None), Query.leased_until <= db.clock(), Query.leased_by == client_id)
    rows = select(Query.id).where(Query.run_id == run_id, Query.status == QueryStatus.OPEN, free)
    with db.read() as session:
        return not rests(session, run_id) and session.scalars(rows.limit(1)).first() is not None


def latest_metrics(db: Database, run_ids: Sequence[int]) -> dict[int, Metric]:
    """The last metrics of each of some runs; a run that has none yet is absent."""
    last = (
        select(Metric.run_id, func.max(Metric.tick).label("tick"))
        .where(Metric.run_id.in_(run_ids))
        .group_by(Metric.run_id)
    )
    newest = last.subquery()
    rows = select(Metric).join(newest, (Metric.run_id == newest.c.run_id) & (Metric.tick == newest.c.tick))
    with db.read() as session:
        return {metric.run_id: metric for metric in session.scalars(rows)}


def first_metrics(db: Database, run_id: int) -> Sequence[Metric]:
    """The first metrics of each stage T of a run (Sec. 2.4), in their order."""
    first = select(func.min(Metric.tick)).where(Metric.run_id == run_id)
    first = first.group_by(Metric.values["maturity"].as_integer())
    rows = select(Metric).where(Metric.run_id == run_id, Metric.tick.in_(first)).order_by(Metric.tick)
    with db.read() as session:
        return session.scalars(rows).all()


def sampled_metrics(db: Database, run_id: int, rows: int = 40) -> Sequence[Metric]:
    """At most about `rows` metrics, evenly spread over the ticks, the last one among them, newest first."""
    with db.read() as session:
        count = session.scalar(select(func.count()).select_from(Metric).where(Metric.run_id == run_id)) or 0
        every = max(1, -(-count // rows))
        number = func.row_number().over(order_by=Metric.tick.desc()) - 1
        numbered = select(Metric.tick, number.label("number")).where(Metric.run_id == run_id).subquery()
        chosen = select(numbered.c.tick).where(numbered.c.number % every == 0)
        found = (
            select(Metric)
            .where(Metric.run_id == run_id, Metric.tick.in_(chosen))
            .order_by(Metric.tick.desc())
        )
        return session.scalars(found).all()
