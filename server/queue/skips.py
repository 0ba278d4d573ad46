"""A parent skips a question that they cannot tell: a row that counts as no answer and trains nothing.

A preference is put back once, behind all others, and withdrawn when it is skipped again. Guidance is heard by
the agent at a tick, as an answer is: it asks about another pair of moves (`agent.guidance`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from sqlalchemy import bindparam, update
from sqlalchemy.orm import Session

from parenting.drawing.sentences import mark
from parenting.server.db import Database
from parenting.server.errors import Conflict
from parenting.server.queue.answers import Said, add
from parenting.server.queue.names import UNSTATED, Names
from parenting.server.queue.revisions import find_locked
from parenting.server.statuses import QueryStatus
from parenting.server.store.relay import announce
from parenting.server.tables import SKIP, Table

Outcome = Literal["set_aside", "put_back", "withdrawn"]


@dataclass(frozen=True)
class Skipped:
    """The reply to a skip."""

    outcome: Outcome
    query: int
    run: int
    number: int | None  # of the row; None: this skip was stored before, and its question put back
    database: str
    run_public_id: str
    query_public_id: str


def skip(
    db: Database,
    query: int | str,
    client_id: str,
    parent: str = "human",
    names: Names = UNSTATED,
    *,
    final: bool = False,
) -> Skipped:
    """Skip a question.

    A skip whose reply was lost may be sent again: a question that was put back is withdrawn only if it was
    leased to this client once more. A `final` skip withdraws a preference at once: a script would only
    skip it again.

    Raises:
        ElsewhereError: it is meant for another database, run or question.
        NotFound: there is no such query.
        Conflict: it was answered, skipped by somebody else, or withdrawn.
    """
    with db.write() as session:
        return skip_in(session, db, query, Said(SKIP, client_id, parent), names, final)


def skip_in(
    session: Session,
    db: Database,
    query: int | str,
    said: Said,
    names: Names = UNSTATED,
    final: bool = False,
) -> Skipped:
    """Skip a question as `skip` does, in a transaction that is already open."""
    place, asked = find_locked(session, db, query, names)
    if asked.standing is not None:
        return Skipped(_before(asked, said), **vars(place), number=asked.number)
    if asked.status == QueryStatus.WITHDRAWN:
        raise Conflict(mark("This question was withdrawn: the run or its episode was ended before that."))
    if asked.put_back and asked.leased_by != said.client_id:
        return Skipped("put_back", **vars(place), number=None)
    ends: Outcome = "withdrawn" if asked.put_back or final else "put_back"
    outcome: Outcome = "set_aside" if asked.kind == "guidance" else ends
    number, _ = add(session, db, asked, said, standing=outcome != "put_back")
    session.execute(_BECOMES[outcome], {"query_id": place.query})
    announce(session, "web")
    return Skipped(outcome, **vars(place), number=number)


def _before(asked: Any, said: Said) -> Outcome:
    """Return the outcome of a skip that stands already."""
    if asked.choice != SKIP:
        raise Conflict(mark("This question was already answered; it was not skipped."))
    if asked.client_id != said.client_id:
        raise Conflict(mark("This question was already skipped by someone else."))
    return "set_aside" if asked.kind == "guidance" else "withdrawn"


# Statements are built once.
_QUERY = Table.metadata.tables["query"]
_ONE = update(_QUERY).where(_QUERY.c.id == bindparam("query_id"))
_NOBODY: dict[str, Any] = dict.fromkeys(
    ("leased_by", "leased_until", "lease_epoch", "lease_begin", "lease_end")
)
_BECOMES = {
    "set_aside": _ONE.values(status=QueryStatus.ANSWERED),
    "put_back": _ONE.values(put_back=True, **_NOBODY),
    "withdrawn": _ONE.values(status=QueryStatus.WITHDRAWN),
}
