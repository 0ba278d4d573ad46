"""What was answered, page by page: for the history on the dashboard, the API's list and the export."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from sqlalchemy import select

from parenting.server.db import Database
from parenting.server.runs import find
from parenting.server.tables import Answer, Query

BATCH = 200


@dataclass(frozen=True)
class Answered:
    """An answer with the query that it answers; a superseded answer is kept, and says so by `standing`."""

    answer: Answer
    query: Query


def after(db: Database, run_id: int, number: int = 0, limit: int = BATCH) -> Sequence[Answered]:
    """The answers of a run behind the one of this number, oldest first, at most `limit`.

    Raises:
        NotFound: there is no such run.
    """
    with db.read() as session:
        find(session, run_id)
        rows = select(Answer, Query).join(Query, Answer.query_id == Query.id)
        rows = rows.where(Answer.run_id == run_id, Answer.number > number).order_by(Answer.number)
        return [Answered(*row) for row in session.execute(rows.limit(limit))]


def before(
    db: Database,
    run_id: int,
    number: int | None = None,
    limit: int = BATCH,
    kind: str | None = None,
    choice: str | None = None,
) -> Sequence[Answered]:
    """The answers of a run before the one of this number, newest first, at most `limit`; None: the last ones.

    With `kind` or `choice`, only those to questions of this kind, or those that say this.

    Raises:
        NotFound: there is no such run.
    """
    with db.read() as session:
        find(session, run_id)
        rows = select(Answer, Query).join(Query, Answer.query_id == Query.id).where(Answer.run_id == run_id)
        if number is not None:
            rows = rows.where(Answer.number < number)
        if kind is not None:
            rows = rows.where(Query.kind == kind)
        if choice is not None:
            rows = rows.where(Answer.choice == choice)
        return [Answered(*row) for row in session.execute(rows.order_by(Answer.number.desc()).limit(limit))]


def every(db: Database, run_id: int, batch: int = BATCH) -> Iterator[Answered]:
    """All answers up to now, oldest first, read in batches: neither memory nor the database is held up.

    Answers are numbered in their own transactions, so none that is stored now is passed over.

    Raises:
        NotFound: there is no such run.
    """
    with db.read() as session:
        last = find(session, run_id).answers
    number = 0
    while number < last:
        rows = [row for row in after(db, run_id, number, batch) if row.answer.number <= last]
        if not rows:
            return
        yield from rows
        number = rows[-1].answer.number
