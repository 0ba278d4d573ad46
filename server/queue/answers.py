"""A parent's answers: store one, once, or supersede it. Each verb is one transaction.

Silence is never consent: no verb answers by itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import bindparam, select, update
from sqlalchemy.orm import Session

from parenting.server.chain import chain_in
from parenting.server.db import Database
from parenting.server.errors import Conflict, NotFound
from parenting.server.queue.locks import lock_query
from parenting.server.queue.names import UNSTATED, Names, Place, find_place
from parenting.server.runs import lock
from parenting.server.statuses import QueryStatus
from parenting.server.store.relay import announce
from parenting.server.tables import Answer, Query, Run


@dataclass(frozen=True)
class Stored:
    """The reply to an answer: only what never changes, so that the same answer gets the same reply."""

    query: int
    run: int
    number: int
    choice: str
    received: datetime
    database: str
    run_public_id: str
    query_public_id: str


@dataclass(frozen=True)
class Said:
    """An answer as it arrives: the choice, the client that sent it, and who decided."""

    choice: str
    client_id: str
    parent: str


def get_query(db: Database, query_id: int) -> Query:
    """Return one query.

    Raises:
        NotFound: there is no such query.
    """
    with db.read() as session:
        query = session.get(Query, query_id)
    if query is None:
        raise NotFound(f"There is no question {query_id}.")
    return query


def answer(
    db: Database, query: int | str, choice: str, client_id: str, parent: str, names: Names = UNSTATED
) -> Stored:
    """Store an answer, once, if it is meant for this database, run and question.

    The same answer by the same client gets the same reply. A late answer is taken if none stands.

    Args:
        db: The database.
        query: The number or the public id of the query that is answered; it need not be leased.
        choice: left, right, either or neither (Sec. 2.3).
        client_id: The name under which the client answers.
        parent: Who decided: human or scripted.
        names: The database, run and question that the answer is meant for, as far as it names them.

    Raises:
        ElsewhereError: it is meant for another database, run or question.
        NotFound: there is no such query.
        Conflict: it was answered otherwise, or by somebody else, or withdrawn; the message says which.
    """
    said = Said(choice, client_id, parent)
    with db.write() as session:
        place = find_place(session, query, names)
        lock(session, place.run)
        before = _standing(session, place.query)
        if before is not None:
            return _again(before, said, place)
        if session.execute(_ANSWERED, {"query_id": place.query}).scalar() is None:
            raise Conflict(
                "This question was withdrawn: the run or its episode was ended before an answer came."
            )
        return _stored(_add(session, db, place.query, place.run, said), place)


def supersede(db: Database, query_id: int, choice: str, client_id: str, parent: str) -> Answer:
    """Put another answer in the place of the one that stands; the old row stays and keeps its tick.

    No page, route or command calls this verb in this version, so no parent can correct an answer yet. Exports
    and the history show superseded answers, and tests hold them to it by this verb.

    Raises:
        NotFound: there is no such query.
        Conflict: there is no answer to supersede yet.
    """
    with db.write() as session:
        query = lock_query(session, query_id)
        before = _standing(session, query_id)
        if before is None:
            raise Conflict(f"Question {query_id} has no answer to supersede.")
        before.standing = False
        session.flush()
        said = Said(choice, client_id, parent)
        return _add(session, db, query_id, query.run_id, said, supersedes=before.id)


def _add(
    session: Session, db: Database, query_id: int, run_id: int, said: Said, supersedes: int | None = None
) -> Answer:
    # Numbered in this transaction: no reader can see number n + 1 before n.
    number = session.execute(_NUMBERED, {"run_id": run_id}).scalar_one()
    row = Answer(
        query_id=query_id,
        run_id=run_id,
        number=number,
        **vars(said),
        supersedes=supersedes,
        standing=True,
        received=db.clock(),
    )
    chain_in(session, row)
    session.add(row)
    session.flush()
    announce(session, "worker")
    return row


def _again(before: Answer, said: Said, place: Place) -> Stored:
    if before.client_id != said.client_id:
        raise Conflict("This question was already answered by someone else; your answer was not stored.")
    if before.choice != said.choice:
        raise Conflict(
            f"You already answered this question with {before.choice}; {said.choice} was not stored."
        )
    return _stored(before, place)


def _stored(row: Answer, place: Place) -> Stored:
    return Stored(**vars(place), number=row.number, choice=row.choice, received=row.received)


def _standing(session: Session, query_id: int) -> Answer | None:
    return session.scalars(_STANDING, {"query_id": query_id}).one_or_none()


# Statements that every answer needs are built once.
_STANDING = select(Answer).where(Answer.query_id == bindparam("query_id"), Answer.standing)
_ANSWERED = (
    update(Query)
    .where(Query.id == bindparam("query_id"), Query.status == QueryStatus.OPEN)
    .values(status=QueryStatus.ANSWERED)
    .returning(Query.id)
    .execution_options(synchronize_session=False)
)
_NUMBERED = (
    update(Run)
    .where(Run.id == bindparam("run_id"))
    .values(answers=Run.answers + 1)
    .returning(Run.answers)
    .execution_options(synchronize_session=False)
)
