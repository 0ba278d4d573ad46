"""Answers with their queries, page by page, for the history page and the export."""

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
    """An answer with its query. A superseded answer is kept; its `standing` is false."""

    answer: Answer
    query: Query


def after(db: Database, run_id: int, number: int = 0, limit: int = BATCH) -> Sequence[Answered]:
    """Return the answers of a run after the one of this number, oldest first, at most `limit`.

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
    """Return the answers of a run before the one of this number, newest first.

    Args:
        db: The database.
        run_id: The run.
        number: Return answers with smaller numbers; None begins with the newest.
        limit: At most this many.
        kind: Only answers to queries of this kind.
        choice: Only answers with this choice.

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
    """Yield all answers up to now, oldest first, read in batches, which saves memory and holds no lock.

    Answers are numbered in their own transactions, so none that is stored now is missed.

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


def number_of(db: Database, answer_id: int) -> int:
    """Return the number, within its run, of an answer."""
    with db.read() as session:
        return session.scalars(select(Answer.number).where(Answer.id == answer_id)).one()
