"""A parent's presence: leases last while somebody looks, end soon after they left, and are told to who waits.

Each verb is one transaction. Deadlines are those of the clock that decides (`server.store.clock`).
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import timedelta

from sqlalchemy import bindparam, select, update
from sqlalchemy.orm import Session

from parenting.server.db import Database
from parenting.server.queue.leases import hold_in
from parenting.server.runs import lock
from parenting.server.statuses import QueryStatus
from parenting.server.store.clock import holds
from parenting.server.tables import Query, Table

GRACE_SECONDS = 5.0
"""Seconds for which a question stays with a client whose page was hidden or closed."""
ATTENTION_SECONDS = 120.0
"""Seconds after a person's last sign of life up to which leases are renewed."""


@dataclass(frozen=True)
class Renewed:
    """The questions of a page by who has them, as public ids."""

    yours: list[str] = field(default_factory=list)  # held by this client, or by nobody
    elsewhere: list[str] = field(default_factory=list)  # held by somebody else
    closed: list[str] = field(default_factory=list)  # answered, withdrawn, or not of this run


@dataclass(frozen=True)
class Held:
    """The leases of a run that hold, and the seconds until the first of them ends (None: there is none)."""

    leases: list[dict[str, str]]
    ends_in: float | None


def holder(client_id: str) -> str:
    """Return a name for a client by which pages tell their own leases from others'.

    A client's own name lets its answers be changed, so it is not told.
    """
    return hashlib.sha256(client_id.encode()).hexdigest()[:16]


def renew(
    db: Database,
    run_id: int,
    client_id: str,
    questions: Sequence[str],
    seconds: float,
    idle: float = 0.0,
    attention: float = ATTENTION_SECONDS,
) -> Renewed:
    """Hold the questions of a page for as long as its person is taken to look at it, and say who has them.

    Args:
        db: The database.
        run_id: The run.
        client_id: The client that shows the questions.
        questions: Their public ids.
        seconds: How long a lease is at most.
        idle: Seconds since the person's last sign of life.
        attention: Seconds after a sign of life at which leases end. After that nothing is renewed, and what
            is held already runs out by itself.
    """
    with db.write(durable=False) as session:
        return renew_in(session, db, run_id, client_id, questions, min(seconds, attention - idle))


def renew_in(
    session: Session, db: Database, run_id: int, client_id: str, questions: Sequence[str], seconds: float
) -> Renewed:
    """Renew as `renew` does, in a transaction that is already open; for no time, it says who has each."""
    if not db.one_writer:
        lock(session, run_id)
    rows = session.execute(_SHOWN, {"run_id": run_id, "questions": list(questions)}).all()
    found = Renewed(closed=sorted({*questions} - {row.public_id for row in rows}))
    mark = db.mark(session).bound()
    theirs = {
        row.id for row in session.execute(_HELD, {"run_id": run_id, **mark}) if row.leased_by != client_id
    }
    for row in rows:
        if row.id in theirs:
            found.elsewhere.append(row.public_id)
            continue
        found.yours.append(row.public_id)
        if seconds > 0:
            hold_in(session, db, row.id, client_id, seconds)
    if found.yours and seconds > 0:
        db.outlive_crash(session)
    return found


def leave(db: Database, run_id: int, client_id: str, seconds: float = GRACE_SECONDS) -> None:
    """Let a client's leases end within `seconds`: its page was hidden or closed. Renewing undoes this."""
    with db.write(durable=False) as session:
        leave_in(session, db, run_id, client_id, seconds)


def leave_in(
    session: Session, db: Database, run_id: int, client_id: str, seconds: float = GRACE_SECONDS
) -> None:
    """Let leases end as `leave` does, in a transaction that is already open."""
    if not db.one_writer:
        lock(session, run_id)
    mark = db.mark(session)
    end = {"end": mark.seconds + seconds, "until": db.clock() + timedelta(seconds=seconds)}
    session.execute(_LEFT, {"run": run_id, "client": client_id, **end, **mark.bound()})


def held(db: Database, run_id: int) -> Held:
    """Return who holds which open question of a run, by the names that `holder` gives."""
    with db.read() as session:
        if session.execute(_LEASED, {"run_id": run_id}).first() is None:
            return Held([], None)
        mark = db.mark(session)
        rows = session.execute(_HELD, {"run_id": run_id, **mark.bound()}).all()
    leases = [{"question": row.public_id, "holder": holder(row.leased_by)} for row in rows]
    return Held(leases, min((row.lease_end - mark.seconds for row in rows), default=None))


# Statements are built once.
_QUERY = Table.metadata.tables["query"]
_OPEN = (Query.run_id == bindparam("run_id"), Query.status == QueryStatus.OPEN)
_LEASED = select(Query.id).where(*_OPEN, Query.leased_by.is_not(None)).limit(1)
_HELD = (
    select(Query.id, Query.public_id, Query.leased_by, Query.lease_end)
    .where(*_OPEN, Query.leased_by.is_not(None))
    .where(holds(Query.lease_epoch, Query.lease_begin, Query.lease_end))
    .order_by(Query.id)
)
_SHOWN = select(Query.id, Query.public_id).where(
    *_OPEN, Query.public_id.in_(bindparam("questions", expanding=True))
)
_LEFT = (
    update(_QUERY)
    .where(_QUERY.c.run_id == bindparam("run"), _QUERY.c.status == QueryStatus.OPEN)
    .where(_QUERY.c.leased_by == bindparam("client"), _QUERY.c.lease_end > bindparam("end"))
    .where(holds(_QUERY.c.lease_epoch, _QUERY.c.lease_begin, _QUERY.c.lease_end))
    .values(lease_end=bindparam("end"), leased_until=bindparam("until"))
)
