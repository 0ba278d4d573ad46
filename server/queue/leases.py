"""A parent's leases: hold the most urgent open query for one client, or let go of it.

A lease is a time, not a status: when it has passed, the query is offered again, so nothing sticks when a
browser dies. Each verb is one transaction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

from sqlalchemy import and_, bindparam, case, func, or_, select, update
from sqlalchemy.orm import Session, aliased
from sqlalchemy.orm.attributes import set_committed_value

from parenting.server.damage import damage, readable
from parenting.server.db import Database
from parenting.server.queue.locks import lock_query
from parenting.server.queue.queries import urgency
from parenting.server.runs import lock
from parenting.server.statuses import QueryStatus
from parenting.server.store.clock import Mark, holds, is_over
from parenting.server.tables import Query, Run, Table

LEASE_SECONDS = 60.0
ROOM = 2
"""Queries that a page has at once: one that it shows, and one for afterwards."""


def waiting(db: Database, run_id: int) -> Query | None:
    """Return the most urgent open query, leased or not: guidance first, then the oldest."""
    rows = select(Query).where(Query.run_id == run_id, Query.status == QueryStatus.OPEN)
    with db.read() as session:
        return session.scalars(rows.order_by(*urgency()).limit(1)).first()


def lease(db: Database, run_id: int, client_id: str, seconds: float = LEASE_SECONDS) -> Query | None:
    """Hold the most urgent open query for a client; None if nothing is free.

    Guidance goes first, then the oldest query. A client that holds one already gets the same one again, for
    `seconds` more. A run that has reached its goal offers nothing.
    """
    return _hold(wanted(db, run_id, client_id, seconds))


def lease_ahead(
    db: Database, run_id: int, client_id: str, shown: Sequence[int], seconds: float = LEASE_SECONDS
) -> Query | None:
    """Hold the most urgent query besides those `shown`, so that the client need not wait for it later.

    None if nothing is free, or if the run's goal is reached once those shown are answered.
    """
    return _hold(wanted(db, run_id, client_id, seconds, shown))


def lease_more(
    db: Database, run_id: int, client_id: str, has: set[int], seconds: float = LEASE_SECONDS
) -> Query | None:
    """Hold one query more for a page that has room for it, as `More` says; None if not."""
    return _hold(More(db, run_id, client_id, has, seconds))


def take(db: Database, run_id: int, client_id: str, seconds: float = LEASE_SECONDS) -> Query | None:
    """Hold a query as `lease` does; where none is free, the most urgent one that somebody else holds.

    Their page says so; whoever answers first, that answer stands. None if nothing is open.
    """
    return _hold(taken(db, run_id, client_id, seconds))


@dataclass(frozen=True)
class Wish:
    """A client's wish for a query, to be granted in a transaction that is already open."""

    db: Database
    offer: Any
    asks: dict[str, Any]
    seconds: float

    def is_offered(self, session: Session) -> bool:
        """Return whether there is such a query; this locks nothing."""
        seen = {**self.asks, **self.db.mark(session).bound()}
        return session.execute(_IDS[self.offer], seen).first() is not None

    def hold(self, session: Session) -> Query | None:
        """Hold it, and return it; None if there is none. Not durable by itself."""
        db = self.db
        if not db.one_writer:
            lock(session, self.asks["run_id"])
        mark = db.mark(session)  # behind the lock: nobody else's lease begins more than SLACK later
        query = _first_readable(session, self.offer, {**self.asks, **mark.bound()})
        if query is not None:
            held = _columns(db, mark, self.asks["client_id"], self.seconds)
            session.execute(_HELD, {"query_id": query.id, "leased_at": db.clock(), **held})
            for name, value in held.items():
                set_committed_value(query, name, value)
            db.outlive_crash(session)
        return query


def wanted(
    db: Database,
    run_id: int,
    client_id: str,
    seconds: float = LEASE_SECONDS,
    shown: Sequence[int] | None = None,
) -> Wish:
    """Return the wish that `lease` grants, or `lease_ahead` where it is told what is `shown`."""
    asks: dict[str, Any] = {"run_id": run_id, "client_id": client_id}
    if shown is None:
        return Wish(db, _OFFER, asks, seconds)
    return Wish(db, _AHEAD, asks | {"shown": list(shown), "to_come": list(shown)}, seconds)


def taken(db: Database, run_id: int, client_id: str, seconds: float = LEASE_SECONDS) -> Wish:
    """Return the wish that `take` grants."""
    return Wish(db, _TAKEN, {"run_id": run_id, "client_id": client_id}, seconds)


@dataclass(frozen=True)
class More:
    """A page's wish for one query more, where it has room for it, besides those that it `has`.

    A page has room for `ROOM`, and for guidance also where it has so many preferences. Queries that are no
    longer open, or held by this client, leave `has`. Where it gave one up, such as one that was put back,
    other parents come first: nothing is held until the next call.
    """

    db: Database
    run_id: int
    client_id: str
    has: set[int]
    seconds: float = LEASE_SECONDS

    def is_offered(self, session: Session) -> bool:
        """Return whether there is room, and a query for it; this locks nothing."""
        return self._has_room(session) and self._wish().is_offered(session)

    def hold(self, session: Session) -> Query | None:
        """Hold it as `Wish.hold` does."""
        return self._wish().hold(session) if self._has_room(session) else None

    def _wish(self) -> Wish:
        return wanted(self.db, self.run_id, self.client_id, self.seconds, sorted(self.has) or None)

    def _has_room(self, session: Session) -> bool:
        seen = {"run_id": self.run_id, "client_id": self.client_id, "has": list(self.has)}
        rows = session.execute(_OPEN_OF, seen | self.db.mark(session).bound()).all()
        first = session.execute(_FIRST, {"run_id": self.run_id}).first()
        self.has.intersection_update(row.id for row in rows if row.mine)
        if first is None or not all(row.mine for row in rows):
            return False
        return len(self.has) < ROOM or (first.id not in self.has and first.kind == "guidance")


def may_lease(db: Database, run_id: int, client_id: str) -> bool:
    """Return whether a query is free for this client, or held for it already."""
    with db.read() as session:
        return wanted(db, run_id, client_id).is_offered(session)


def release(db: Database, query_id: int, client_id: str) -> None:
    """Offer a leased query to others at once. Only its holder can; anybody else changes nothing.

    Raises:
        NotFound: there is no such query.
    """
    with db.write() as session:
        release_in(session, query_id, client_id)


def release_in(session: Session, query_id: int, client_id: str) -> None:
    """Offer a query to others as `release` does, in a transaction that is already open."""
    lock_query(session, query_id)
    session.execute(_RELEASED, {"query_id": query_id, "client": client_id})


def is_offered(session: Session, db: Database, run_id: int, client_id: str) -> bool:
    """Return whether a query is free for this client, or held for it already, in an open transaction."""
    return wanted(db, run_id, client_id).is_offered(session)


def lease_in(session: Session, db: Database, run_id: int, client_id: str, seconds: float) -> Query | None:
    """Hold a query as `lease` does, in a transaction that is already open; not durable by itself."""
    return wanted(db, run_id, client_id, seconds).hold(session)


def _hold(wish: Wish | More) -> Query | None:
    with wish.db.read() as session:  # nothing to offer is the common case, and takes no lock
        if not wish.is_offered(session):
            return None
    with wish.db.write(durable=False) as session:
        return wish.hold(session)


def hold_in(session: Session, db: Database, query_id: int, client_id: str, seconds: float) -> None:
    """Hold one open query for a client, unless another holds it, in a transaction that is already open."""
    mark = db.mark(session)
    asks = {"query_id": query_id, "client_id": client_id, "leased_at": db.clock(), **mark.bound()}
    session.execute(_HELD_IF_FREE, asks | _columns(db, mark, client_id, seconds))


def _columns(db: Database, mark: Mark, client_id: str, seconds: float) -> dict[str, Any]:
    return {
        "leased_by": client_id,
        "leased_until": db.clock() + timedelta(seconds=seconds),
        "lease_epoch": mark.epoch,
        "lease_begin": mark.seconds,
        "lease_end": mark.seconds + seconds,
    }


def _first_readable(session: Session, offer: Any, asks: dict[str, Any]) -> Query | None:
    """Return the most urgent query that can be shown; damaged ones are not offered while there are others.

    Raises:
        DamagedRowError: all that could be offered is damaged, and nothing is on a page yet.
    """
    damaged: list[Query] = []
    while True:
        others = offer.where(Query.id.not_in([query.id for query in damaged])) if damaged else offer
        query: Query | None = session.scalars(others, asks).first()
        if query is None:
            if damaged and "shown" not in asks:
                readable(damaged[0])
            return None
        if damage(query) is None:
            return query
        damaged.append(query)


# Statements that every question needs are built once.
_QUERY = Table.metadata.tables["query"]
_HELD = (
    update(_QUERY)
    .where(_QUERY.c.id == bindparam("query_id"))
    .values(leased=func.coalesce(_QUERY.c.leased, bindparam("leased_at", type_=_QUERY.c.leased.type)))
)
_RELEASED = (
    update(_QUERY)
    .where(_QUERY.c.id == bindparam("query_id"), _QUERY.c.leased_by == bindparam("client"))
    .values(leased_by=None, leased_until=None, lease_epoch=None, lease_begin=None, lease_end=None)
)
_LEASE = (Query.lease_epoch, Query.lease_begin, Query.lease_end)
_MINE = and_(Query.leased_by == bindparam("client_id"), holds(*_LEASE))
_FREE = is_over(*_LEASE)
_HELD_IF_FREE = _HELD.where(_QUERY.c.status == QueryStatus.OPEN, or_(_MINE, _FREE))
_STANDING = Run.answers - Run.retracted
_ANY = (
    select(Query)
    .join(Run, Run.id == Query.run_id)
    .where(Query.run_id == bindparam("run_id"), Query.status == QueryStatus.OPEN)
    .limit(1)
)
_OPEN = _ANY.where(or_(_MINE, _FREE))
_WANTED = or_(Run.goal.is_(None), Run.goal > _STANDING)
_OFFER = _OPEN.where(_WANTED).order_by(case((_MINE, 0), else_=1), *urgency())
_TAKEN = _ANY.where(_WANTED).order_by(case((_MINE, 0), (_FREE, 1), else_=2), *urgency())
_other = aliased(Query)
# Two names for one list: under one name SQLAlchemy writes an empty list for IN and for NOT IN alike, which on
# PostgreSQL offers nothing.
_SHOWN: Any = bindparam("shown", expanding=True)
_TO_COME: Any = bindparam("to_come", expanding=True)
_ANSWERS_TO_COME = (
    select(func.count())
    .where(_other.run_id == Run.id, _other.status == QueryStatus.OPEN, _other.id.in_(_TO_COME))
    .correlate(Run)
    .scalar_subquery()
)
_AHEAD = _OPEN.where(
    Query.id.not_in(_SHOWN), or_(Run.goal.is_(None), Run.goal > _STANDING + _ANSWERS_TO_COME)
).order_by(*urgency())
_OPEN_OF = select(Query.id, _MINE.label("mine")).where(
    Query.run_id == bindparam("run_id"),
    Query.status == QueryStatus.OPEN,
    Query.id.in_(bindparam("has", expanding=True)),
)
_FIRST = (
    select(Query.id, Query.kind)
    .where(Query.run_id == bindparam("run_id"), Query.status == QueryStatus.OPEN)
    .order_by(*urgency())
    .limit(1)
)
_IDS = {offer: offer.with_only_columns(Query.id) for offer in (_OFFER, _TAKEN, _AHEAD)}
"""The same for whoever asks only whether there is one."""
