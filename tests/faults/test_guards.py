"""The database itself refuses what no verb does: plain SQL breaks no invariant, on both stores."""

from __future__ import annotations

import pytest
from sqlalchemy import text
from sqlalchemy.exc import IntegrityError

from parenting.server.db import Database
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.runs import Claim
from tests.server.conftest import CLIPS

COLUMNS = "query_id, run_id, number, choice, parent, client_id, supersedes, standing, received, applied_tick"
STATEMENTS = {
    "a second standing answer": f"INSERT INTO answer ({COLUMNS}) SELECT query_id, run_id, 9, choice, parent, "
    "'b', id, standing, received, 99 FROM answer WHERE number = 1",
    "a second first answer of a client": f"INSERT INTO answer ({COLUMNS}) SELECT query_id, run_id, 9, "
    "choice, parent, client_id, NULL, (1 = 0), received, 99 FROM answer WHERE number = 1",
    "a number twice": "UPDATE answer SET number = 1 WHERE number = 2",
    "a tick heard twice": "UPDATE answer SET applied_tick = 3",
    "a tick asked twice": "UPDATE query SET tick = 1",
    "an unknown choice": "UPDATE answer SET choice = 'both'",
    "an unknown status": "UPDATE query SET status = 'lost'",
    "an answer to no query": "UPDATE answer SET query_id = 99 WHERE number = 1",
}


@pytest.mark.parametrize("what", STATEMENTS)
def test_database_itself_refuses(db: Database, mine: Claim, what: str) -> None:
    for tick in (1, 2):
        answer(db, post_query(db, mine, tick, "guidance", 1, CLIPS), "left", "a", "human")
    take_answer(db, mine, 3)
    take_answer(db, mine, 4)
    with pytest.raises(IntegrityError), db.write() as session:
        session.execute(text(STATEMENTS[what]))
