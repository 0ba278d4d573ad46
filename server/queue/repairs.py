"""Damaged clips of a question, written again as the agent asks it when its tick is replayed.

A replayed tick asks what it asked before. The digest of an answer to the question proves that it is the same
(`server.chain`). Where nobody has answered yet, no digest exists; the machine that wrote the record asks the
same again, so a question that nobody could read is asked as it was.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import structlog
from sqlalchemy import select, update
from sqlalchemy.orm import Session

from parenting.server.chain import OF_QUERY, proves
from parenting.server.damage import damage, sound
from parenting.server.db import Database
from parenting.server.runs import Claim, held
from parenting.server.tables import Answer, Query

log = structlog.get_logger()


def repair(
    db: Database, mine: Claim, stored: Query, asked: Mapping[str, Any], same_machine: bool
) -> Query | None:
    """Write a question as its replayed tick asks it, if that is what was stored; None: it is not proved.

    Args:
        db: The database.
        mine: The worker's claim on the run.
        stored: The row, damaged or of other content than what is asked.
        asked: Its kind, maturity, votes and clips as the agent asks them now.
        same_machine: This machine wrote the record of the question's tick.

    Raises:
        LostClaimError: another worker trains this run now.
    """
    with db.write() as session:
        held(session, mine)
        if not _proved(session, stored, asked, same_machine and damage(stored) is not None):
            return None
        session.execute(update(Query).where(Query.id == stored.id).values(**asked))
    log.warning("a damaged question was written again", run=mine.run_id, question=stored.id)
    with db.read() as session:
        return session.get_one(Query, stored.id)


def _proved(session: Session, stored: Query, asked: Mapping[str, Any], otherwise: bool) -> bool:
    """Return whether an answer's digest is of what is asked; without any answer, `otherwise`."""
    answers = session.scalars(select(Answer).where(Answer.query_id == stored.id)).all()
    content = {name: sound(stored, name) for name in OF_QUERY} | dict(asked)
    return any(proves(one, content) for one in answers) if answers else otherwise
