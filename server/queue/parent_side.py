"""The parents' verbs on queries and answers: lease, release, answer, correct.

One transaction each; all their SQL is here.

A lease is a timestamp: nothing sticks when a browser dies. Silence is never consent: no verb answers by
itself. The worker's verbs (post, take, withdraw) are in `server.queue.worker_side`.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import ColumnElement, Select, and_, bindparam, case, or_, select, update
from sqlalchemy.orm import Session

from parenting.server.db import Database
from parenting.server.errors import Conflict, NotFound
from parenting.server.runs import lock
from parenting.server.statuses import QueryStatus
from parenting.server.tables import Answer, Query, Run

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
        if session.execute(_OFFERED, _asks(db, run_id, client_id)).first() is None:
            return None
    with db.write(durable=False) as session:
        lock(session, run_id)
        asks = _asks(db, run_id, client_id)
        query = session.scalars(_OFFER, asks).first()
        if query is not None:
            query.leased_by, query.leased_until = client_id, asks["now"] + timedelta(seconds=seconds)
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
        run_id = _hold(session, query_id)
        before = _standing(session, query_id)
        if before is not None:
            return _again(before, choice, client_id)
        if session.execute(_ANSWERED, {"query_id": query_id}).scalar() is None:
            raise Conflict(
                f"Question {query_id} was withdrawn: the run or its episode was ended before an answer came."
            )
        return _stored(_add(session, db, query_id, run_id, choice, client_id, parent))


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
        return _add(session, db, query_id, query.run_id, choice, client_id, parent, supersedes=before.id)


def _add(
    session: Session,
    db: Database,
    query_id: int,
    run_id: int,
    choice: str,
    client_id: str,
    parent: str,
    supersedes: int | None = None,
) -> Answer:
    # numbered in this transaction: no reader can see number n + 1 before n
    number = session.execute(_NUMBERED, {"run_id": run_id}).scalar_one()
    row = Answer(
        query_id=query_id,
        run_id=run_id,
        number=number,
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


def _hold(session: Session, query_id: int) -> int:
    """The run of a query, locked, so that nobody else writes to its queries."""
    run_id: int | None = session.execute(_RUN_OF, {"query_id": query_id}).scalar()
    if run_id is None:
        raise NotFound(f"There is no question {query_id}.")
    lock(session, run_id)
    return run_id


def _held(session: Session, query_id: int) -> Query:
    """A query, locked after its run: everyone locks in this order, or two could wait for each other."""
    _hold(session, query_id)
    return session.get_one(Query, query_id, with_for_update=True)


def _query(session: Session, query_id: int) -> Query:
    query = session.get(Query, query_id)
    if query is None:
        raise NotFound(f"There is no question {query_id}.")
    return query


def _standing(session: Session, query_id: int) -> Answer | None:
    return session.scalars(_STANDING, {"query_id": query_id}).one_or_none()


def guidance_first() -> ColumnElement[int]:
    """The order of urgency by kind: an agent that waits for guidance does not live."""
    return case((Query.kind == "guidance", 0), else_=1)


def rests(session: Session, run_id: int) -> bool:
    """Whether a run's goal is reached: it offers no more questions."""
    run = session.get(Run, run_id)
    return run is not None and run.goal is not None and run.answers >= run.goal


def _urgent(run_id: int) -> Select[Query]:
    rows = select(Query).where(Query.run_id == run_id, Query.status == QueryStatus.OPEN)
    return rows.order_by(guidance_first(), Query.tick).limit(1)


def _asks(db: Database, run_id: int, client_id: str) -> dict[str, Any]:
    return {"run_id": run_id, "client_id": client_id, "now": db.clock()}


# Statements that every answer needs are built once.
_RUN_OF = select(Query.run_id).where(Query.id == bindparam("query_id"))
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
_KEPT = and_(Query.leased_by == bindparam("client_id"), Query.leased_until > bindparam("now"))
_FREE = or_(Query.leased_until.is_(None), Query.leased_until <= bindparam("now"))
_OFFER = (
    select(Query)
    .join(Run, Run.id == Query.run_id)
    .where(Query.run_id == bindparam("run_id"), Query.status == QueryStatus.OPEN, or_(_KEPT, _FREE))
    .where(or_(Run.goal.is_(None), Run.answers < Run.goal))
    .order_by(case((_KEPT, 0), else_=1), guidance_first(), Query.tick)
    .limit(1)
)
_OFFERED = _OFFER.with_only_columns(Query.id)
