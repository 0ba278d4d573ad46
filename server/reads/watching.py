"""Look at many runs at once: what streams tell of them, and whether another question may be leased."""

from __future__ import annotations

import json
import time
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import Row, bindparam, func, select
from sqlalchemy.orm import Session

from parenting.server.db import Database
from parenting.server.queue.presence import holder
from parenting.server.queue.queries import urgency
from parenting.server.reads.metrics import list_metrics
from parenting.server.reads.offering import Offer, offers
from parenting.server.reads.schemas import SILENT_AFTER, metric_schemas, run_schemas
from parenting.server.schemas import RunSchema
from parenting.server.statuses import OVER, QueryStatus
from parenting.server.store.clock import Mark
from parenting.server.tables import Query, Run, Worker

ROWS = 10_000
"""Metrics in one event, at most."""


@dataclass(frozen=True)
class Seen:
    """One look at a run. Two of them are equal where nothing has changed that anybody is told."""

    question: str
    """The most urgent open question (id and kind) as JSON, or null."""
    leases: str
    """The leases that hold, as JSON."""
    offers: Any
    """The values on which it depends which questions can be leased."""
    row: Any
    """The columns that the run's schema shows and that may change."""
    signed: bool
    """True if its worker has given a sign of life. Where it has not, others decide what is told."""


@dataclass(frozen=True)
class Look:
    """One look at many runs: those that are there, and when the first of their leases ends."""

    runs: dict[int, Seen]
    offers: dict[int, Offer]
    """The same of runs that nobody follows, whose next question somebody waits for."""
    ends: float  # by the monotonic clock; infinite where nobody holds any
    cost: float  # seconds of the processor


@dataclass(frozen=True)
class Rows:
    """Some metrics of a run as an event tells them, their last tick, and whether there may be more."""

    text: str
    last: int | None
    more: bool


def look(db: Database, run_ids: Sequence[int], asked: Sequence[int] = ()) -> Look:
    """Look at runs by four statements, however many they are, and at those that are only asked by one."""
    began = time.thread_time()
    with db.read() as session:
        mark, found, offered, ends = db.mark(session), dict[int, Seen](), dict[int, Offer](), float("inf")
        if run_ids:
            found, ends = _followed(session, run_ids, mark)
        if asked:
            offered, soonest = offers(session, asked, mark)
            ends = min(ends, soonest)
    return Look(found, offered, ends, time.thread_time() - began)


def _followed(session: Session, run_ids: Sequence[int], mark: Mark) -> tuple[dict[int, Seen], float]:
    """Return what is seen of runs, and when the first of their leases ends."""
    asks = {"runs": list(run_ids)}
    runs = session.execute(_RUNS, asks).all()
    counted, leased = defaultdict[int, list[Row[Any]]](list), defaultdict[int, list[Row[Any]]](list)
    for statement, rows in ((_COUNTED, counted), (_LEASED, leased)):
        for row in session.execute(statement, asks):
            rows[row.run_id].append(row)
    firsts = {row.run_id: row for row in session.execute(_FIRST, asks)}
    found, left = {}, float("inf")
    for row in runs:
        if isinstance(row.deleting, datetime):
            continue
        found[row.id], soonest = _seen(row, firsts.get(row.id), counted[row.id], leased[row.id], mark)
        left = min(left, soonest)
    return found, time.monotonic() + left


def _seen(
    run: Row[Any], first: Row[Any] | None, counted: Sequence[Row[Any]], leased: Sequence[Row[Any]], mark: Mark
) -> tuple[Seen, float]:
    """Return what is seen of a run, and the seconds until its first lease ends."""
    question = None if first is None else {"id": first.id, "public_id": first.public_id, "kind": first.kind}
    held = [row for row in leased if _holds(row, mark)]
    leases = [{"question": row.public_id, "holder": holder(row.leased_by)} for row in held]
    asked = [tuple(row) for row in counted]
    offers = (
        run.status,
        run.goal,
        run.answers,
        run.retracted,
        asked,
        [(row.id, row.leased_by) for row in held],
    )
    *shown, epoch, seconds, its_epoch, its_seconds = tuple(run)
    marks, within = ((epoch, seconds), (its_epoch, its_seconds)), SILENT_AFTER.total_seconds()
    signed = run.status in OVER or any(mark.is_recent(*one, within) for one in marks)
    seen = Seen(json.dumps(question), json.dumps(leases), offers, (*shown, asked), signed)
    return seen, min((row.lease_end - mark.seconds for row in held), default=float("inf"))


def _holds(row: Row[Any], mark: Mark) -> bool:
    """Return whether a lease holds, as `server.store.clock.holds` says it in SQL."""
    begun = mark.is_recent(row.lease_epoch, row.lease_begin, float("inf"))
    return begun and isinstance(row.lease_end, float) and row.lease_end > mark.seconds


def told_runs(db: Database, run_ids: Sequence[int]) -> dict[int, str]:
    """Return runs as the API does, as JSON; a damaged one is left out."""
    with db.read() as session:
        runs = session.scalars(_WHOLE, {"runs": list(run_ids)}).all()
    schemas = run_schemas(db, runs)
    return {one.id: one.model_dump_json() for one in schemas if isinstance(one, RunSchema)}


def told_metrics(db: Database, run_id: int, after: int) -> Rows:
    """Return the metrics of a run after a tick as an event tells them."""
    rows = list_metrics(db, run_id, after, ROWS)
    shown = [row.model_dump(mode="json") for row in metric_schemas(rows)]
    ticks = [row["tick"] for row in shown if row["tick"] is not None]
    return Rows(json.dumps({"rows": shown}), ticks[-1] if ticks else None, bool(ticks) and len(rows) == ROWS)


# What never changes, or is large, or is only a sign of life, is not read at each look.
_LEFT_OUT = {"level_text", "legend", "brief", "config", "versions", "origin", "heartbeat", "fencing_token"}
_SIGNS = ("claim_epoch", "claim_mark")
_COLUMNS = [column for column in Run.__table__.columns if column.name not in {*_LEFT_OUT, *_SIGNS}]
_NAMED = Run.id.in_(bindparam("runs", expanding=True))
_RUNS = (
    select(*_COLUMNS, Run.claim_epoch, Run.claim_mark, Worker.epoch, Worker.mark)
    .outerjoin(Worker, Worker.name == Run.worker)
    .where(_NAMED)
)
_WHOLE = select(Run).where(_NAMED)
_OPEN = (Query.run_id.in_(bindparam("runs", expanding=True)), Query.status == QueryStatus.OPEN)
# Hundreds may be open, so they are counted: the sums tell one set of questions from another.
_COUNTED = (
    select(Query.run_id, Query.kind, func.count(), func.sum(Query.id), func.max(Query.id))
    .add_columns(func.count().filter(Query.put_back))
    .where(*_OPEN)
    .group_by(Query.run_id, Query.kind)
    .order_by(Query.run_id, Query.kind)
)
_LEASED = (
    select(Query.run_id, Query.id, Query.public_id)
    .add_columns(Query.leased_by, Query.lease_epoch, Query.lease_begin, Query.lease_end)
    .where(*_OPEN, Query.leased_by.is_not(None))
    .order_by(Query.id)
)
_PLACED = (
    select(Query.run_id, Query.id, Query.public_id, Query.kind)
    .add_columns(func.row_number().over(partition_by=Query.run_id, order_by=urgency()).label("place"))
    .where(*_OPEN)
    .subquery()
)
_FIRST = select(_PLACED).where(_PLACED.c.place == 1)
