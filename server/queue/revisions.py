"""A parent's second thoughts: take an answer back, or change it. Each verb is one transaction.

An answer that the agent has not heard is withdrawn, and its question is open again. One that it has heard is
changed: another row stands in its place, which the agent hears at a tick of its own (`corrections`). Rows are
only ever added.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from sqlalchemy import bindparam, select, update
from sqlalchemy.orm import Session

from parenting.drawing.sentences import mark
from parenting.server.db import Database
from parenting.server.errors import Conflict
from parenting.server.queue.answers import Said, Stored, add, find_asked
from parenting.server.queue.leases import LEASE_SECONDS, hold_in
from parenting.server.queue.names import UNSTATED, Names, Place, find_place
from parenting.server.runs import lock
from parenting.server.statuses import OVER, QueryStatus
from parenting.server.store.relay import announce
from parenting.server.tables import SKIP, Table

SOMEONE_ELSES = mark(
    "This question was answered by someone else; only they can take their answer back or change it."
)


@dataclass(frozen=True)
class Changed(Stored):
    """The answer that stands after a change."""

    heard: bool  # the agent has heard an earlier answer to this question


@dataclass(frozen=True)
class Withdrawn:
    """The reply to a withdrawal."""

    outcome: Literal["withdrawn", "heard"]
    query: int
    run: int
    choice: str | None  # that was taken back, or that stands; None: this client gave none
    database: str
    run_public_id: str
    query_public_id: str


def supersede(
    db: Database, query: int | str, choice: str, client_id: str, parent: str, names: Names = UNSTATED
) -> Changed:
    """Put another answer in the place of one's own, or of anybody's skip; the old row keeps its tick.

    The same choice changes nothing, so a change whose reply was lost may be sent again.

    Raises:
        ElsewhereError: it is meant for another database, run or question.
        NotFound: there is no such query.
        Conflict: there is no answer to supersede, or it is somebody else's and no skip.
    """
    with db.write() as session:
        return supersede_in(session, db, query, Said(choice, client_id, parent), names)


def supersede_in(
    session: Session, db: Database, query: int | str, said: Said, names: Names = UNSTATED
) -> Changed:
    """Change an answer as `supersede` does, in a transaction that is already open."""
    place, asked = find_locked(session, db, query, names)
    if asked.standing is None:
        raise Conflict(mark("Question {question} has no answer to supersede."), question=place.query)
    if asked.choice != SKIP:
        _own(asked, said.client_id)
    number, received = asked.number, asked.received
    if asked.choice != said.choice:
        _retract(session, asked)
        number, received = add(session, db, asked, said)
        if asked.status == QueryStatus.WITHDRAWN:  # it was skipped twice
            session.execute(_ANSWERED, {"query_id": place.query})
    heard = asked.status == QueryStatus.APPLIED
    return Changed(**vars(place), number=number, choice=said.choice, received=received, heard=heard)


def withdraw(
    db: Database,
    query: int | str,
    client_id: str,
    names: Names = UNSTATED,
    seconds: float = LEASE_SECONDS,
) -> Withdrawn:
    """Take back an answer of one's own that the agent has not heard; its question is open again.

    It is leased to the same client. An answer that was heard stays, and the outcome says so. A skip is taken
    back in the same way. A withdrawal whose reply was lost may be sent again. From a client that never
    answered it, it changes nothing.

    Raises:
        ElsewhereError: it is meant for another database, run or question.
        NotFound: there is no such query.
        Conflict: the answer is somebody else's, the question was withdrawn, or the run is over.
    """
    with db.write() as session:
        return withdraw_in(session, db, query, client_id, names, seconds)


def withdraw_in(
    session: Session, db: Database, query: int | str, client_id: str, names: Names, seconds: float
) -> Withdrawn:
    """Take an answer back as `withdraw` does, in a transaction that is already open."""
    place, asked = find_locked(session, db, query, names)
    if asked.standing is not None:
        _own(asked, client_id)
        if asked.status == QueryStatus.APPLIED:
            return Withdrawn("heard", choice=asked.choice, **vars(place))
        if asked.run_status in OVER:
            raise Conflict(mark("The run is over, so its questions are not asked again; the answer stands."))
        _retract(session, asked)
        session.execute(_REOPENED, {"query_id": place.query})
        announce(session, "web")
    elif asked.status == QueryStatus.WITHDRAWN:
        raise Conflict(mark("This question was withdrawn: the run or its episode was ended."))
    elif asked.put_back and session.execute(_LAST_BY, {"answer_id": asked.last}).scalar() == client_id:
        session.execute(_REOPENED, {"query_id": place.query})
        session.execute(_UNSKIPPED, {"run_id": place.run})
    if session.execute(_GIVEN, {"query_id": place.query, "client_id": client_id}).first() is not None:
        hold_in(session, db, place.query, client_id, seconds)
    return Withdrawn("withdrawn", choice=asked.choice, **vars(place))


def find_locked(session: Session, db: Database, query: int | str, names: Names) -> tuple[Place, Any]:
    """Return where a question is, its run locked, and the question with the answer that stands."""
    place = find_place(session, query, names)
    if not db.one_writer:
        lock(session, place.run)
    return place, find_asked(session, place.query)


def _own(asked: Any, client_id: str) -> None:
    if asked.client_id != client_id:
        raise Conflict(SOMEONE_ELSES)


def _retract(session: Session, asked: Any) -> None:
    """Let the answer that stands stand no more."""
    session.execute(_FALLEN, {"answer_id": asked.standing})
    session.execute(_UNSKIPPED if asked.choice == SKIP else _COUNTED, {"run_id": asked.run_id})


# Statements are built once.
_RUN, _QUERY, _ANSWER = (Table.metadata.tables[name] for name in ("run", "query", "answer"))
_FALLEN = update(_ANSWER).where(_ANSWER.c.id == bindparam("answer_id")).values(standing=False)
_COUNTED = update(_RUN).where(_RUN.c.id == bindparam("run_id")).values(retracted=_RUN.c.retracted + 1)
_GIVEN = (
    select(_ANSWER.c.id)
    .where(_ANSWER.c.query_id == bindparam("query_id"), _ANSWER.c.client_id == bindparam("client_id"))
    .limit(1)
)
_UNSKIPPED = update(_RUN).where(_RUN.c.id == bindparam("run_id")).values(skipped=_RUN.c.skipped - 1)
_ONE = update(_QUERY).where(_QUERY.c.id == bindparam("query_id"))
_REOPENED = _ONE.values(status=QueryStatus.OPEN, put_back=False)
_ANSWERED = _ONE.values(status=QueryStatus.ANSWERED)
_LAST_BY = select(_ANSWER.c.client_id).where(_ANSWER.c.id == bindparam("answer_id"))
