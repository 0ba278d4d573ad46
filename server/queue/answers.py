"""A parent's answers: store one, once. Each verb is one transaction; `revisions` changes an answer.

Silence is never consent: no verb answers by itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import and_, bindparam, func, insert, select, update
from sqlalchemy.orm import Session

from parenting.drawing.sentences import mark
from parenting.server.chain import BEGIN, OF_QUERY, hashes
from parenting.server.db import Database
from parenting.server.errors import Conflict, NotFound
from parenting.server.persons import person_of
from parenting.server.queue.names import UNSTATED, Names, Place, find_place
from parenting.server.runs import lock
from parenting.server.statuses import QueryStatus
from parenting.server.store.relay import announce
from parenting.server.tables import SKIP, Query, Table


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

    choice: str  # left, right, either or neither (Sec. 2.3), or skip
    client_id: str
    parent: str
    replays: int | None = None  # how often they had the clips played again
    measured: dict[str, Any] | None = None  # by the page (`server.measures.Measured`)

    @property
    def skips(self) -> bool:
        """Return whether the parent cannot tell: such a row counts as no answer."""
        return self.choice == SKIP


def get_query(db: Database, query_id: int) -> Query:
    """Return one query.

    Raises:
        NotFound: there is no such query.
    """
    with db.read() as session:
        query = session.get(Query, query_id)
    if query is None:
        raise NotFound(mark("There is no question {question}."), question=query_id)
    return query


def answer(
    db: Database, query: int | str, choice: str, client_id: str, parent: str, names: Names = UNSTATED
) -> Stored:
    """Store an answer, once, if it is meant for this database, run and question.

    The same answer by the same client gets the same reply. A late answer is taken if none stands. One that
    follows an answer that was taken back names its row.

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
    with db.write() as session:
        return answer_in(session, db, query, Said(choice, client_id, parent), names)


def answer_in(
    session: Session, db: Database, query: int | str, said: Said, names: Names = UNSTATED
) -> Stored:
    """Store an answer as `answer` does, in a transaction that is already open."""
    place = find_place(session, query, names)
    if not db.one_writer:
        lock(session, place.run)
    asked = find_asked(session, place.query)
    if asked.standing is not None:
        return _again(asked, said, place)
    if session.execute(_ANSWERED, {"query_id": place.query}).scalar() is None:
        raise Conflict(
            mark("This question was withdrawn: the run or its episode was ended before an answer came.")
        )
    number, received = add(session, db, asked, said)
    return Stored(**vars(place), number=number, choice=said.choice, received=received)


def find_asked(session: Session, query: int) -> Any:
    """Return a question as it is hashed, with the answer that stands and the last link of its run's chain."""
    return session.execute(_ASKED, {"query_id": query}).one()


def add(
    session: Session, db: Database, asked: Any, said: Said, standing: bool = True
) -> tuple[int, datetime]:
    """Add an answer after the last one to its question, and return its number and time."""
    run_id: int = asked.run_id
    # Numbered in this transaction: no reader can see number n + 1 before n.
    number = session.execute(_NUMBERED, {"run_id": run_id}).scalar_one()
    row = {
        "query_id": asked.query_id,
        "run_id": run_id,
        "number": number,
        **vars(said),
        "supersedes": asked.last,
        "standing": standing,
        "received": db.clock(),
    }
    link = asked.last_link if isinstance(asked.last_link, str) else ""
    before = BEGIN if number == 1 else link
    if said.parent == "human":
        person_of(session, said.client_id, row["received"])
    session.execute(_INSERTED, row | hashes(row, asked._mapping, before))
    if said.skips:
        session.execute(_SKIPPED, {"run_id": run_id})
    announce(session, "worker")
    return number, row["received"]


def _again(asked: Any, said: Said, place: Place) -> Stored:
    if asked.choice == SKIP and not said.skips:
        raise Conflict(
            mark("This question was skipped and is not asked now; change the skip to your answer.")
        )
    if asked.client_id != said.client_id:
        raise Conflict(
            mark("This question was already answered by someone else; your answer was not stored.")
        )
    if asked.choice != said.choice:
        raise Conflict(
            mark("You already answered this question with {first}; {second} was not stored."),
            first=asked.choice,
            second=said.choice,
        )
    return Stored(**vars(place), number=asked.number, choice=asked.choice, received=asked.received)


# Statements that every answer needs are built once.
_RUN, _QUERY, _ANSWER = (Table.metadata.tables[name] for name in ("run", "query", "answer"))
_run, _query, _answer, _last, _earlier = _RUN.c, _QUERY.c, _ANSWER.c, _ANSWER.alias(), _ANSWER.alias()
_BEFORE = select(func.max(_earlier.c.id)).where(_earlier.c.query_id == _query.id).scalar_subquery()
_ASKED = (
    select(
        _query.id.label("query_id"),
        _run.status.label("run_status"),
        *(_query[name] for name in ("run_id", "status", "put_back", "leased_by", *OF_QUERY)),
        _answer.id.label("standing"),
        *(_answer[name] for name in ("client_id", "choice", "number", "received")),
        _last.c.link.label("last_link"),
        select(func.max(_earlier.c.id))
        .where(_earlier.c.query_id == _query.id)
        .scalar_subquery()
        .label("last"),
    )
    .select_from(_QUERY)
    .join(_RUN, _run.id == _query.run_id)
    .outerjoin(_ANSWER, and_(_answer.query_id == _query.id, _answer.standing))
    .outerjoin(_last, and_(_last.c.run_id == _run.id, _last.c.number == _run.answers))
    .where(_query.id == bindparam("query_id"))
)
_ANSWERED = (
    update(_QUERY)
    .where(_query.id == bindparam("query_id"), _query.status == QueryStatus.OPEN)
    .values(status=QueryStatus.ANSWERED)
    .returning(_query.id)
)
_NUMBERED = (
    update(_RUN)
    .where(_run.id == bindparam("run_id"))
    .values(answers=_run.answers + 1)
    .returning(_run.answers)
)
_SKIPPED = (
    update(_RUN)
    .where(_run.id == bindparam("run_id"))
    .values(skipped=_run.skipped + 1, retracted=_run.retracted + 1)
)
_INSERTED = insert(_ANSWER)
