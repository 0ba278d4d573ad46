"""The pages of the people who answered: the list, the page before a deletion, the worker that does it."""

from __future__ import annotations

import re
import time

import httpx2

from parenting.server import erasure
from parenting.server.db import Database
from parenting.server.persons import name_person, pseudonyms
from parenting.server.queue.answers import answer
from parenting.server.runs import Claim
from parenting.server.work.chores import Chores
from tests.pages import island_fixtures as fixtures

ANN = "cookie-of-ann"


def test_a_person_is_listed_and_a_worker_deletes_what_the_page_was_told(
    client: httpx2.Client, db: Database
) -> None:
    assert "Nobody has answered yet." in client.get("/persons").text
    _, mine = fixtures.start_run(db)
    query = fixtures.ask(db, mine, 1, "guidance", fixtures.guidance("left", "down", start=(1, 2)))
    answer(db, query, "left", ANN, "human")
    ann = pseudonyms(db, [ANN])[ANN]
    name_person(db, ann, "<b>Ann</b>", None)
    listed = client.get("/persons").text
    for place in ("persons", "audit", "access"):
        found = re.findall(r'<a href="/(access|persons|audit)"', client.get(f"/{place}").text)
        assert found == ["access", "persons", "audit"], "they lead to each other"
    assert f"<b>{ann}</b> (<bdi>&lt;b&gt;Ann&lt;/b&gt;</bdi>)" in listed
    assert ANN not in listed, "the name of a browser lets others answer as this person"
    asks = client.get(f"/persons/{ann}/delete").text
    assert "Deleted as a whole, since nobody else answered" in asks
    assert client.post(f"/persons/{ann}/delete", data={"confirm": "p22222222a"}).status_code == 409
    assert client.get("/persons/p22222222a/delete").status_code == 404
    assert erasure.under_way(db) == []
    client.follow_redirects = False
    assert client.post(f"/persons/{ann}/delete", data={"confirm": ann}).headers["location"] == "/persons"
    assert "A worker is deleting their data." in client.get("/persons").text
    chores(db, mine)
    assert "Nobody has answered yet." in client.get("/persons").text


def chores(db: Database, mine: Claim) -> None:
    """Let a worker do what waits: of that person, it deletes the run, too."""
    worker = Chores(db, 0.0)
    for _ in range(20):
        worker.news()
        worker._due = 0.0
        worker.go_on()
        while not worker.erasures.may_begin():
            time.sleep(0.01)
        if not erasure.under_way(db):
            return
    raise AssertionError(f"the deletion does not end; run {mine.run_id}")
