"""Metrics of runs: the last row, the first of each stage, a sample, or all after a tick."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session

from parenting.server.damage import damage
from parenting.server.db import Database
from parenting.server.runs import find
from parenting.server.tables import Metric


def list_metrics(db: Database, run_id: int, after: int = -1, limit: int = 10_000) -> Sequence[Metric]:
    """Return the metrics of the ticks after `after`, in their order, at most `limit`.

    Raises:
        NotFound: there is no such run.
    """
    with db.read() as session:
        find(session, run_id)
        rows = select(Metric).where(Metric.run_id == run_id, Metric.tick > after)
        return session.scalars(rows.order_by(Metric.tick).limit(limit)).all()


def latest_metrics(db: Database, run_ids: Sequence[int]) -> dict[int, Metric]:
    """Return the last metrics of each run; a run that has none yet, or a damaged last row, is absent."""
    last = (
        select(Metric.run_id, func.max(Metric.tick).label("tick"))
        .where(Metric.run_id.in_(run_ids))
        .group_by(Metric.run_id)
    )
    newest = last.subquery()
    rows = select(Metric).join(newest, (Metric.run_id == newest.c.run_id) & (Metric.tick == newest.c.tick))
    with db.read() as session:
        return {metric.run_id: metric for metric in session.scalars(rows) if damage(metric) is None}


def first_metrics(db: Database, run_id: int) -> Sequence[Metric]:
    """Return the first metrics of each stage T of a run (Sec. 2.4), in their order.

    A stage never decreases. So its first tick is found by bisection, in a few look-ups by key, where a search
    of all rows would take longer with every tick of the life. Damaged rows are passed over.
    """
    of_run = select(Metric).where(Metric.run_id == run_id).order_by(Metric.tick)
    with db.read() as session:
        first = _sound(session, of_run)
        last = _sound(session, of_run.order_by(None).order_by(Metric.tick.desc()))
        found = [] if first is None else [first]
        while last is not None and found[-1].values["maturity"] != last.values["maturity"]:
            found.append(_next_stage(session, of_run, found[-1], last))
        return found


def _next_stage(session: Session, of_run: Select[Metric], first: Metric, last: Metric) -> Metric:
    """Return the first metrics of the stage after that of `first`; `last` is of a later stage."""
    low, high, found = first.tick, last.tick, last
    while low + 1 < high:  # up to `low` it is the stage of `first`, and from `high` on a later one
        middle = (low + high) // 2
        row = _sound(session, of_run.where(Metric.tick >= middle)) or found
        if row.values["maturity"] == first.values["maturity"]:
            low = row.tick
        else:
            high, found = middle, row
    return found


def _sound(session: Session, rows: Select[Metric]) -> Metric | None:
    """Return the first row that can be read and knows its stage; a second look passes over damaged ones."""
    for limit in (1, 1000):
        for row in session.scalars(rows.limit(limit)):
            if damage(row) is None and "maturity" in row.values:
                return row
    return None


def sampled_metrics(db: Database, run_id: int, rows: int = 40) -> Sequence[Metric]:
    """Return about `rows` metrics at most, evenly spread over the ticks, newest first, the last included.

    Damaged rows are left out.
    """
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
        return [row for row in session.scalars(found) if damage(row) is None]
