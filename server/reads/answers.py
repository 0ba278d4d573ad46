"""Answers with their queries, page by page, for the history page and the export."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from sqlalchemy import inspect, select

from parenting.server.columns import Damaged
from parenting.server.damage import damage
from parenting.server.db import Database
from parenting.server.runs import find
from parenting.server.tables import Answer, Query

BATCH = 200
EVERY = 2**63 - 1
"""A number that no answer exceeds."""


@dataclass(frozen=True)
class Answered:
    """An answer with its query. A superseded answer is kept; its `standing` is false."""

    answer: Answer
    query: Query  # without an id: the answer names a question that is not there

    @property
    def damage(self) -> str | None:
        """Say what of the answer and its question cannot be read; None if all is sound."""
        asked = "its question is missing" if inspect(self.query).transient else damage(self.query)
        return "; ".join(filter(None, (damage(self.answer), asked))) or None

    @property
    def placed(self) -> bool:
        """Return whether its number can be read."""
        return not isinstance(self.answer.number, Damaged)


def after(db: Database, run_id: int, number: int | None = None, limit: int = BATCH) -> Sequence[Answered]:
    """Return the answers of a run after the one of this number or all, oldest first, at most `limit`.

    Raises:
        NotFound: there is no such run.
    """
    with db.read() as session:
        find(session, run_id)
        rows = select(Answer, Query).outerjoin(Query, Answer.query_id == Query.id)
        rows = rows.where(Answer.run_id == run_id).order_by(Answer.number)
        if number is not None:
            rows = rows.where(Answer.number > number)
        return [_answered(*row) for row in session.execute(rows.limit(limit))]


def before(
    db: Database,
    run_id: int,
    number: int | None = None,
    limit: int = BATCH,
    kind: str | None = None,
    choice: str | None = None,
    client_id: str | None = None,
) -> Sequence[Answered]:
    """Return the answers of a run before the one of this number, newest first.

    Args:
        db: The database.
        run_id: The run.
        number: Return answers with smaller numbers; None begins with the newest.
        limit: At most this many.
        kind: Only answers to queries of this kind.
        choice: Only answers with this choice.
        client_id: Only answers that were given under this name.

    Raises:
        NotFound: there is no such run.
    """
    with db.read() as session:
        find(session, run_id)
        rows = select(Answer, Query).outerjoin(Query, Answer.query_id == Query.id)
        rows = rows.where(Answer.run_id == run_id)
        if client_id is not None:
            rows = rows.where(Answer.client_id == client_id)
        if number is not None:
            rows = rows.where(Answer.number < number)
        if kind is not None:
            rows = rows.where(Query.kind == kind)
        if choice is not None:
            rows = rows.where(Answer.choice == choice)
        return [_answered(*row) for row in session.execute(rows.order_by(Answer.number.desc()).limit(limit))]


def every(db: Database, run_id: int, batch: int = BATCH) -> Iterator[Answered]:
    """Yield all answers up to now, oldest first, read in batches, which saves memory and holds no lock.

    Answers are numbered in their own transactions, so none that is stored now is missed. An answer whose
    number is damaged has no place in the order; it comes as soon as it is met, once.

    Raises:
        NotFound: there is no such run.
    """
    with db.read() as session:
        stored = find(session, run_id).answers
    last = EVERY if isinstance(stored, Damaged) else stored
    number: int | None = None
    misplaced = set()
    while number is None or number < last:
        rows = after(db, run_id, number, batch)
        placed = [row for row in rows if row.placed and row.answer.number <= last]
        yield from placed
        for row in rows:
            if not row.placed and row.answer.id not in misplaced:
                misplaced.add(row.answer.id)
                yield row
        if not placed:
            return
        number = placed[-1].answer.number


def number_of(db: Database, answer_id: int) -> int | None:
    """Return the number, within its run, of an answer; None if that is damaged."""
    with db.read() as session:
        found = session.scalars(select(Answer.number).where(Answer.id == answer_id)).one_or_none()
        return found if isinstance(found, int) else None


def _answered(answer: Answer, query: Query | None) -> Answered:
    return Answered(answer, Query() if query is None else query)
