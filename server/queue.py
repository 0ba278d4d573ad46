"""The parents' verbs on queries and answers: lease, release, answer, correct.

One transaction each; all their SQL is here.

A lease is a timestamp: nothing sticks when a browser dies. Silence is never consent: no verb answers by
itself. The worker's verbs (post, take, withdraw) are in `server.mailbox`.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, Select, case, or_, select
from sqlalchemy.orm import Session

from server.db import Database
from server.errors import Conflict, NotFound
from server.runs import hold
from server.tables import Answer, Query, Run

LEASE_SECONDS = 60.0


@dataclass(frozen=True)
class Stored:
    """The reply to an answer: only what never changes, so that the same answer gets the same reply."""

    query: int
    run: int
    number: int
    choice: str
    received: datetime


def get_query(db: Database, query_id: int) -> Query:
    """One query.

    Raises:
        NotFound: there is none of this id.
    """
    with db.read() as session:
        return _query(session, query_id)


def standing(db: Database, query_id: int) -> Answer | None:
    """The answer that stands for a query, if it has one."""
    with db.read() as session:
        return _standing(session, query_id)


def waiting(db: Database, run_id: int) -> Query | None:
    """The most urgent open query, leased or not: guidance first, then the oldest."""
    with db.read() as session:
        return session.scalars(_urgent(run_id)).first()


def lease(db: Database, run_id: int, client_id: str, seconds: float = LEASE_SECONDS) -> Query | None:
    """Hold the most urgent open query that nobody else holds for this client; None if there is none.

    Guidance goes first, then the oldest. A client that still holds one gets the same again, for `seconds`
    more. A run that has reached its goal offers nothing.
    """
    with db.read() as session:  # nothing to offer is the common case, and takes no lock
        if _offer(session, run_id, client_id, db.clock()) is None:
            return None
    with db.write() as session:
        hold(session, run_id)
        now = db.clock()
        query = _offer(session, run_id, client_id, now)
        if query is not None:
            query.leased_by, query.leased_until = client_id, now + timedelta(seconds=seconds)
        return query


def release(db: Database, query_id: int, client_id: str) -> None:
    """Let go of a leased query at once, so that it is offered again; only its holder can."""
    with db.write() as session:
        query = _held(session, query_id)
        if query.leased_by == client_id:
            query.leased_by = query.leased_until = None


def answer(db: Database, query_id: int, choice: str, client_id: str, parent: str) -> Stored:
    """Store an answer, once.

    The same again by the same client gets the same reply; a late one is taken if none stands.

    Raises:
        NotFound: there is no such query.
        Conflict: it was answered otherwise, or by someone else, or withdrawn; the message says which.
    """
    with db.write() as session:
        query = _held(session, query_id)
        before = _standing(session, query_id)
        if before is not None:
            return _again(before, choice, client_id)
        if query.status != "open":
            raise Conflict(
                f"Question {query_id} was withdrawn: the run or its episode was ended before an answer came."
            )
        row = _add(session, db, query, choice, client_id, parent)
        query.status = "answered"
        return _stored(row)


def correct(db: Database, query_id: int, choice: str, client_id: str, parent: str) -> Answer:
    """Supersede the standing answer by a new row.

    If the agent had heard the old one, its tick stays on the old row.

    Raises:
        NotFound: there is no such query.
        Conflict: there is no answer to correct yet.
    """
    with db.write() as session:
        query = _held(session, query_id)
        before = _standing(session, query_id)
        if before is None:
            raise Conflict(f"Question {query_id} has no answer to correct.")
        before.standing = False
        session.flush()
        return _add(session, db, query, choice, client_id, parent, supersedes=before.id)


def _add(
    session: Session,
    db: Database,
    query: Query,
    choice: str,
    client_id: str,
    parent: str,
    supersedes: int | None = None,
) -> Answer:
    run = hold(session, query.run_id)
    run.answers += 1  # numbered in this transaction: no reader can see number n + 1 before n
    row = Answer(
        query_id=query.id,
        run_id=run.id,
        number=run.answers,
        choice=choice,
        parent=parent,
        client_id=client_id,
        supersedes=supersedes,
        standing=True,
        received=db.clock(),
    )
    session.add(row)
    session.flush()
    return row


def _again(before: Answer, choice: str, client_id: str) -> Stored:
    if before.client_id != client_id:
        raise Conflict(
            f"Question {before.query_id} was already answered by someone else; your answer was not stored."
        )
    if before.choice != choice:
        raise Conflict(
            f"You already answered question {before.query_id} with {before.choice}; {choice} was not stored."
        )
    return _stored(before)


def _stored(row: Answer) -> Stored:
    return Stored(
        query=row.query_id, run=row.run_id, number=row.number, choice=row.choice, received=row.received
    )


def _held(session: Session, query_id: int) -> Query:
    """A query, locked after its run: everyone locks in this order, or two could wait for each other."""
    query = _query(session, query_id)
    hold(session, query.run_id)
    session.refresh(query, with_for_update=True)
    return query


def _query(session: Session, query_id: int) -> Query:
    query = session.get(Query, query_id)
    if query is None:
        raise NotFound(f"There is no question {query_id}.")
    return query


def _standing(session: Session, query_id: int) -> Answer | None:
    return session.scalars(select(Answer).where(Answer.query_id == query_id, Answer.standing)).one_or_none()


def guidance_first() -> ColumnElement[int]:
    """The order of urgency by kind: an agent that waits for guidance does not live."""
    return case((Query.kind == "guidance", 0), else_=1)


def rests(session: Session, run_id: int, more: int = 0) -> bool:
    """Whether a run's goal is reached once `more` questions are answered: it offers no others."""
    run = session.get(Run, run_id)
    return run is not None and run.goal is not None and run.answers + more >= run.goal


def _urgent(run_id: int) -> Select[Query]:
    rows = select(Query).where(Query.run_id == run_id, Query.status == "open")
    return rows.order_by(guidance_first(), Query.tick).limit(1)


def _offer(session: Session, run_id: int, client_id: str, now: datetime) -> Query | None:
    if rests(session, run_id):
        return None
    mine = session.scalars(
        _urgent(run_id).where(Query.leased_by == client_id, Query.leased_until > now)
    ).first()
    if mine is not None:
        return mine
    free = or_(Query.leased_until.is_(None), Query.leased_until <= now)
    return session.scalars(_urgent(run_id).where(free)).first()
