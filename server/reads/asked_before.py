"""Guidance that was answered in an earlier visit, and that an agent asks about again (`relabel`)."""

from __future__ import annotations

from collections.abc import Mapping

from sqlalchemy import select
from sqlalchemy.orm import Session

from parenting.server.tables import SKIP, Answer, Query


def is_doubted(session: Session, query: Query, relabels: bool) -> bool:
    """Return whether a question doubts an answer to guidance about the same two moves in the same state.

    Only an agent that relabels asks for this reason. An answer that was taken back and a skip do not count,
    and it does not matter which move stood on which side.
    """
    if not relabels or query.kind != "guidance":
        return False
    before = select(Query.clips).join(Answer, Answer.query_id == Query.id)
    before = before.where(Answer.standing, Answer.choice != SKIP, Query.run_id == query.run_id)
    before = before.where(Query.kind == query.kind, Query.tick < query.tick)
    sides = [query.clips["left"], query.clips["right"]]
    return any(
        isinstance(clips, Mapping) and [clips.get("left"), clips.get("right")] in (sides, sides[::-1])
        for clips in session.scalars(before)
    )
