"""The guidance that was skipped in the pause that an agent is in: its page offers it again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sqlalchemy import and_, select

from parenting.server.damage import damage
from parenting.server.db import Database
from parenting.server.statuses import QueryStatus, Waiting
from parenting.server.tables import SKIP, Answer, Query, Run

MOST = 20
"""Guidance queries that are looked at: a pause has six pairs, and what was refused between them."""


def set_aside(db: Database, run_id: int) -> Sequence[Query]:
    """Return the skipped questions of an agent that has no other pair to ask about, oldest first."""
    standing = and_(Answer.query_id == Query.id, Answer.standing)
    rows = select(Query, Answer.choice).outerjoin(Answer, standing).join(Run, Run.id == Query.run_id)
    rows = rows.where(Query.run_id == run_id, Query.kind == "guidance", Run.waiting == Waiting.UNSURE)
    found: list[Query] = []
    with db.read() as session:
        for query, choice in session.execute(rows.order_by(Query.tick.desc()).limit(MOST)):
            if damage(query) is not None or choice in (None, "neither"):
                continue
            if (
                choice != SKIP
                or query.status != QueryStatus.APPLIED
                or (found and _place(found[0]) != _place(query))
            ):
                break
            found.append(query)
    return found[::-1]


def _place(query: Query) -> Any:
    """Return the moment at which guidance was asked."""
    return query.clips["left"]["frames"][0]
