"""A question that is asked again says so, on the page, to those who hear it, and over the API."""

from __future__ import annotations

import httpx2
import pytest
from sqlalchemy import update

from parenting.drawing.query_view import DOUBTED, TO_BE_SURE
from parenting.server.db import Database
from parenting.server.pages.texts import AGAIN
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.tables import Answer, Run
from tests.pages import island_fixtures as fixtures
from tests.pages.parent_page import address

ME = "client-of-mine"


def test_it_is_never_shown_as_a_plain_repeat(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    client.cookies.set("parenting_client", ME)
    clips = fixtures.guidance("left", "down", start=(1, 2))
    first = fixtures.ask(db, mine, 1, "guidance", clips)
    assert TO_BE_SURE not in client.get(address(db, query=first)).text
    leased = client.post("/api/v1/runs/1/queries/lease", json={"client_id": ME}).json()
    assert (leased["votes"], TO_BE_SURE in leased["sentences"]) == (0, False)
    answer(db, first, "left", ME, "human")
    take_answer(db, mine, 2)
    mirrored = {"left": clips["right"], "right": clips["left"]}
    again = post_query(db, mine, 2, "guidance", 1, mirrored, votes=1)
    page = client.get(address(db, query=again)).text
    assert f'<b class="aside">{TO_BE_SURE}</b>' in page  # shown on phones, too
    assert TO_BE_SURE in page.partition('data-spoken="')[2].partition('"')[0]
    assert " data-again " in page  # another answer contradicts nothing
    leased = client.post("/api/v1/runs/1/queries/lease", json={"client_id": ME}).json()
    assert (leased["votes"], leased["sentences"][0]) == (1, TO_BE_SURE)
    assert client.get("/runs/1/history", follow_redirects=True).text.count(TO_BE_SURE) == 0
    answer(db, again, "right", ME, "human")
    assert client.get("/runs/1/history", follow_redirects=True).text.count(TO_BE_SURE) == 1


def test_an_answer_that_was_heard_may_not_have_moved_yet(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    client.cookies.set("parenting_client", ME)
    query = fixtures.ask(db, mine, 1, "guidance", fixtures.guidance("left", "down", start=(1, 2)))
    answer(db, query, "left", ME, "human")
    take_answer(db, mine, 2)
    change = address(db, query=query) + "&change=true"
    assert AGAIN["moved"] in client.get(change).text
    with db.write() as session:
        config = session.get_one(Run, 1).config
        session.execute(update(Run).values(config={**config, "confirm": 0.95}))
    assert AGAIN["voted"] in client.get(change).text


@pytest.mark.parametrize(
    ("relabels", "moves", "doubted"), [(True, 2, True), (False, 2, False), (True, 3, False)]
)
def test_a_doubted_answer_is_asked_about_to_be_sure(
    client: httpx2.Client, db: Database, relabels: bool, moves: int, doubted: bool
) -> None:
    """A later visit of the same state, sides exchanged: only an agent that relabels doubts that pair."""
    _, mine = fixtures.start_run(db)
    with db.write() as session:
        config = session.get_one(Run, 1).config
        session.execute(update(Run).values(config={**config, "relabel": relabels}))
    client.cookies.set("parenting_client", ME)
    clips = fixtures.guidance("left", "down", start=(1, 2))
    first = fixtures.ask(db, mine, 1, "guidance", clips)
    assert DOUBTED not in client.get(address(db, query=first)).text
    answer(db, first, "left", ME, "human")
    take_answer(db, mine, 2)
    other = clips["left"] if moves == 2 else fixtures.guidance("left", "right", start=(1, 2))["right"]
    later = fixtures.ask(db, mine, 9, "guidance", {"left": clips["right"], "right": other})
    page = client.get(address(db, query=later)).text
    leased = client.post("/api/v1/runs/1/queries/lease", json={"client_id": ME}).json()
    assert (f'<b class="aside">{DOUBTED}</b>' in page, " data-again " in page) == (doubted, doubted)
    assert (leased["votes"], leased["sentences"][0] == DOUBTED) == (0, doubted)


def test_an_answer_that_was_taken_back_is_not_doubted(client: httpx2.Client, db: Database) -> None:
    _, mine = fixtures.start_run(db)
    with db.write() as session:
        config = session.get_one(Run, 1).config
        session.execute(update(Run).values(config={**config, "relabel": True}))
    clips = fixtures.guidance("left", "down", start=(1, 2))
    first = fixtures.ask(db, mine, 1, "guidance", clips)
    answer(db, first, "left", ME, "human")
    take_answer(db, mine, 2)
    later = fixtures.ask(db, mine, 9, "guidance", clips)
    assert DOUBTED in client.get(address(db, query=later)).text
    with db.write() as session:
        session.execute(update(Answer).values(standing=False))
    assert DOUBTED not in client.get(address(db, query=later)).text
