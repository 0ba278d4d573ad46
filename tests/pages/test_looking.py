"""Looking changes nothing: every page is fetched, and the database holds the same rows as before."""

from __future__ import annotations

from typing import Any

import httpx2
from sqlalchemy import select

from parenting.server import operator_events
from parenting.server.db import Database
from parenting.server.progress import report_progress
from parenting.server.queue import answers
from parenting.server.tables import Table
from tests.pages import island_fixtures as fixtures
from tests.test_docs import page_routes

QUERIES = {
    "/": ["?before=2"],
    "/runs/{run_id}/parent": ["?query=1", "?query=2"],
    "/runs/{run_id}/history": ["?kind=guidance"],
}


def rows(db: Database) -> dict[str, list[Any]]:
    """Everything that is stored."""
    with db.read() as session:
        return {
            table.name: [tuple(row) for row in session.execute(select(table))]
            for table in Table.metadata.sorted_tables
        }


def test_no_get_changes_anything(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db, goal=1)
    fixtures.measure(db, mine, 30)
    for tick, kind in ((31, "preference"), (32, "guidance")):
        query = fixtures.ask(db, mine, tick, kind, fixtures.guidance("left", "down"))
    answers.answer(db, query, "left", "me", "human")
    operator_events.add_operator_event(db, 1, "end_episode", {"kind": "end_episode"})
    _, other = fixtures.start_run(db)
    report_progress(db, other, waiting="stuck")
    fixtures.ask(db, other, 1, "guidance", fixtures.guidance("left", "down"))
    before = rows(db)
    assert all(before[name] for name in ("run", "query", "answer", "event", "metric"))
    looked = 0
    for path in page_routes():
        for run in (1, 2):
            for query_string in ("", *QUERIES.get(path, [])):
                reply = client.get(
                    path.format(run_id=run, job_id=1, rest=0, pseudonym="p0") + query_string,
                    follow_redirects=True,
                )
                looked += reply.status_code == 200
    assert looked >= 12
    assert rows(db) == before


def test_a_post_would_be_noticed(client: httpx2.Client, db: Database) -> None:
    """The control: what the forms do is seen in the rows."""
    _, mine = fixtures.start_run(db)
    fixtures.ask(db, mine, 1, "guidance", fixtures.guidance("left", "down"))
    before = rows(db)
    client.post("/runs/1/parent/next", data={"client_id": "me"})
    assert rows(db) != before
