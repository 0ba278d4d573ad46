"""Lists for the API, page by page: runs, questions, operator events, metrics.

The cursor of a page is the key of its last row, and the next page begins after it. So rows that are added
meanwhile shift nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from sqlalchemy import select
from sqlalchemy.orm import Session

from parenting.server.columns import Damaged
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.reads.metrics import list_metrics
from parenting.server.runs import find
from parenting.server.statuses import QueryStatus
from parenting.server.tables import Answer, Metric, OperatorEvent, Query

Row = TypeVar("Row")


@dataclass(frozen=True)
class Page(Generic[Row]):
    """Some rows, and the cursor of the next page; None if these are the last ones for now."""

    rows: Sequence[Row]
    next: int | None


@dataclass(frozen=True)
class Asked:
    """A query, and the answer that stands for it, if there is one."""

    query: Query
    answer: Answer | None


def asked_after(
    db: Database, run_id: int, tick: int, limit: int, status: QueryStatus | None = None
) -> Page[Asked]:
    """Return the queries that a run posted after a tick, oldest first, only of one status if given.

    Raises:
        NotFound: there is no such run.
    """
    rows = select(Query).where(Query.run_id == run_id, Query.tick > tick).order_by(Query.tick)
    if status is not None:
        rows = rows.where(Query.status == status)
    with db.read() as session:
        find(session, run_id)
        page = cut(session.scalars(rows.limit(limit + 1)).all(), limit, lambda query: query.tick)
        answers = _standing(session, [query.id for query in page.rows])
        return Page([Asked(query, answers.get(query.id)) for query in page.rows], page.next)


def asked(db: Database, query_id: int) -> Asked:
    """Return one query, with its answer.

    Raises:
        NotFound: there is none of this id.
    """
    with db.read() as session:
        query = session.get(Query, query_id)
        if query is None:
            raise NotFound(f"There is no question {query_id}.")
        return Asked(query, _standing(session, [query_id]).get(query_id))


def operator_events_after(db: Database, run_id: int, event_id: int, limit: int) -> Page[OperatorEvent]:
    """Return the operator events of a run after the one of this id, in their order.

    Raises:
        NotFound: there is no such run.
    """
    event = OperatorEvent
    rows = select(event).where(event.run_id == run_id, event.id > event_id).order_by(event.id)
    with db.read() as session:
        find(session, run_id)
        return cut(session.scalars(rows.limit(limit + 1)).all(), limit, lambda event: event.id)


def metrics_after(db: Database, run_id: int, tick: int, limit: int) -> Page[Metric]:
    """Return the metrics of the ticks after a tick, in their order.

    Raises:
        NotFound: there is no such run.
    """
    return cut(list_metrics(db, run_id, tick, limit + 1), limit, lambda metric: metric.tick)


def cut(rows: Sequence[Row], limit: int, place: Callable[[Row], int]) -> Page[Row]:
    """Return a page of `limit` rows; one row more than that says that another page follows.

    A row whose place is damaged gives no cursor: the one before it does. SQLite sorts such rows last.
    """
    shown = rows[:limit]
    places = [place(row) for row in shown] if len(rows) > limit else []
    return Page(shown, next((at for at in reversed(places) if not isinstance(at, Damaged)), None))


def _standing(session: Session, query_ids: Sequence[int]) -> dict[int, Answer]:
    rows = select(Answer).where(Answer.query_id.in_(query_ids), Answer.standing)
    return {answer.query_id: answer for answer in session.scalars(rows)}
