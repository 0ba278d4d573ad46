"""Lock a query behind its run. Everybody locks in this order, or two could wait for each other."""

from __future__ import annotations

from sqlalchemy import bindparam, select
from sqlalchemy.orm import Session

from parenting.drawing.sentences import mark
from parenting.server.errors import NotFound
from parenting.server.runs import lock
from parenting.server.tables import Query


def lock_run_of(session: Session, query_id: int) -> int:
    """Lock the run of a query, so that nobody else writes to its queries, and return its id.

    Raises:
        NotFound: there is no such query.
    """
    run_id: int | None = session.execute(_RUN_OF, {"query_id": query_id}).scalar()
    if run_id is None:
        raise NotFound(mark("There is no question {question}."), question=query_id)
    lock(session, run_id)
    return run_id


def lock_query(session: Session, query_id: int) -> Query:
    """Lock the run of a query, then the query, and return the query.

    Raises:
        NotFound: there is no such query.
    """
    lock_run_of(session, query_id)
    return session.get_one(Query, query_id, with_for_update=True)


_RUN_OF = select(Query.run_id).where(Query.id == bindparam("query_id"))
