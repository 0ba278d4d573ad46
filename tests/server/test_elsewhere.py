"""An answer is stored where it is meant to be, and by no other database, run or question of equal number."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
from fastapi.testclient import TestClient
from sqlalchemy import delete, func, select, text

from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.errors import ElsewhereError, NotFound
from parenting.server.identity import database_id, renew
from parenting.server.public_ids import public_id
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease
from parenting.server.queue.names import Names
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import claim
from parenting.server.settings import Settings
from parenting.server.tables import Answer, Query, Run
from tests.database import migrated
from tests.server.conftest import CLIPS, Clock
from tests.server.test_identity import ask, start_one


@pytest.fixture
def other(tmp_path: Path, clock: Clock) -> Iterator[Database]:
    """A second database with a run and a question of the same numbers."""
    database = migrated(Settings(data=tmp_path / "other", database_url=None), clock)
    renew(database)  # these tests make databases as copies of one
    start_one(database)
    (mine,) = claim(database, "worker-1")
    assert post_query(database, mine, 5, "guidance", 1, CLIPS) == 1
    yield database
    database.close()


@pytest.fixture
def at_other(other: Database, tmp_path: Path) -> Iterator[httpx2.Client]:
    app = create_app(Settings(data=tmp_path / "other", database_url=None), other)
    with TestClient(app, base_url="http://localhost", follow_redirects=False) as caller:
        yield caller


def names_of(db: Database, query: int = 1) -> dict[str, str]:
    """The names that a question's page and its lease carry."""
    with db.read() as session:
        row = session.get_one(Query, query)
        run = session.get_one(Run, row.run_id)
    return {"database": database_id(db), "run": run.public_id, "question": row.public_id}


def count(db: Database) -> int:
    with db.read() as session:
        return session.scalar(select(func.count()).select_from(Answer)) or 0


def test_the_lease_has_the_names_and_the_receipt_repeats_them(
    client: httpx2.Client, db: Database, guidance: int
) -> None:
    leased = client.post("/api/v1/runs/1/queries/lease", json={"client_id": "me"}).json()
    names = names_of(db)
    assert (leased["database"], leased["run_public_id"], leased["public_id"]) == tuple(names.values())
    stored = client.post(
        f"/api/v1/queries/{guidance}/answer", json={"choice": "left", "client_id": "me", **names}
    )
    assert stored.status_code == 200
    receipt = stored.json()
    assert [receipt[key] for key in ("database", "run_public_id", "query_public_id")] == list(names.values())


@pytest.mark.parametrize("by", ["number", "public id"])
def test_answer_that_names_something_else_is_not_stored(
    client: httpx2.Client, db: Database, other: Database, guidance: int, by: str
) -> None:
    here, there = names_of(db), names_of(other)
    body = {"choice": "left", "client_id": "me", **here}
    query = guidance if by == "number" else here["question"]
    for name in here:
        reply = client.post(f"/api/v1/queries/{query}/answer", json={**body, name: there[name]})
        assert (reply.status_code, reply.json()["error"]["code"]) == (410, "elsewhere")
    assert count(db) == 0
    assert client.post(f"/api/v1/queries/{query}/answer", json=body).status_code == 200


def test_two_databases_of_equal_numbers_never_share_an_answer(
    at_other: httpx2.Client, db: Database, other: Database, guidance: int
) -> None:
    """The page of one is open while the other is served at its address."""
    meant = names_of(db)
    for named in ((), ("database",), ("run",), ("question",), tuple(meant)):
        body = {"choice": "left", "client_id": "me", **{name: meant[name] for name in named}}
        for query in (meant["question"], guidance) if named else (meant["question"],):
            reply = at_other.post(f"/api/v1/queries/{query}/answer", json=body)
            assert (reply.status_code, reply.json()["error"]["code"]) == (410, "elsewhere")
    form = {"choice": "left", "client_id": "me", "database": meant["database"], "question": meant["question"]}
    page = at_other.post(f"/runs/{meant['run']}/parent/answer", data=form)
    assert page.status_code == 410
    assert "meant for another database" in page.text
    assert count(other) == count(db) == 0


def test_form_of_a_page_of_the_old_version_is_not_stored(at_other: httpx2.Client, other: Database) -> None:
    form = {"choice": "left", "client_id": "somebody", "query_id": 1}
    page = at_other.post("/runs/1/parent/answer", data=form)
    assert page.status_code == 410
    assert "Open the page again." in page.text
    assert count(other) == 0


def test_renewed_copy_refuses_what_was_meant_for_the_original(
    client: httpx2.Client, db: Database, guidance: int
) -> None:
    before = names_of(db)
    renew(db)
    body = {"choice": "left", "client_id": "me", **before}
    assert client.post(f"/api/v1/queries/{before['question']}/answer", json=body).status_code == 410
    form = {key: body[key] for key in ("choice", "client_id", "database", "question")}
    assert client.post(f"/runs/{before['run']}/parent/answer", data=form).status_code == 410
    assert count(db) == 0
    fresh = names_of(db)
    assert fresh["question"] == before["question"], "what is offered keeps its name"
    assert client.post(f"/api/v1/queries/{guidance}/answer", json={**body, **fresh}).status_code == 200


@pytest.mark.only("sqlite", "PostgreSQL takes nothing for a text that is none")
@pytest.mark.parametrize(
    "damage", ["UPDATE database_identity SET uuid = x'ff00'", "DELETE FROM database_identity"]
)
def test_a_database_that_cannot_say_which_it_is_stores_no_answer(
    client: httpx2.Client, db: Database, guidance: int, damage: str
) -> None:
    body = {"choice": "left", "client_id": "me", **names_of(db)}
    with db.write() as session:
        session.execute(text(damage))
    reply = client.post(f"/api/v1/queries/{guidance}/answer", json=body)
    assert (reply.status_code, reply.json()["error"]["code"]) == (500, "damaged")
    assert "identity of this database" in client.get("/").text
    assert count(db) == 0


def test_answer_to_a_deleted_question_goes_to_no_later_one(db: Database, guidance: int) -> None:
    meant = names_of(db)
    with db.write() as session:
        session.execute(delete(Query).where(Query.id == guidance))
    (mine,) = claim(db, "worker-2", seconds=-1)
    later = ask(db, mine, 6)
    for query in (guidance, meant["question"], later):
        with pytest.raises(ElsewhereError):
            answer(db, query, "left", "me", "human", Names(**meant))
    assert count(db) == 0


def test_number_that_is_not_there_is_not_found_if_nothing_is_named(
    client: httpx2.Client, db: Database, run: Run
) -> None:
    with pytest.raises(NotFound):
        answer(db, 99, "left", "me", "human")
    body = {"choice": "left", "client_id": "me"}
    assert client.post("/api/v1/queries/99/answer", json=body).json()["error"]["code"] == "not_found"


def test_address_takes_a_number_or_a_public_id(client: httpx2.Client, db: Database, guidance: int) -> None:
    names = names_of(db)
    for path in ("", "/metrics", "/operator-events", "/queries", "/export"):
        by_number, by_name = (client.get(f"/api/v1/runs/{run}{path}") for run in (1, names["run"]))
        assert (by_number.status_code, by_number.content) == (200, by_name.content)
        assert client.get(f"/api/v1/runs/{public_id()}{path}").status_code == 404
    question = [client.get(f"/api/v1/queries/{query}").json() for query in (guidance, names["question"])]
    assert question[0] == question[1]


def test_a_public_id_may_stand_wherever_a_verb_names_a_run_or_a_question(
    client: httpx2.Client, db: Database, guidance: int
) -> None:
    names = names_of(db)
    for verb in ("pause", "resume", "end-episode"):
        assert client.post(f"/api/v1/runs/{names['run']}/{verb}").json()["id"] == 1
    held: Any = client.post(f"/api/v1/runs/{names['run']}/queries/lease", json={"client_id": "me"}).json()
    assert held["id"] == guidance
    client.post(f"/api/v1/queries/{names['question']}/release", json={"client_id": "me"})
    assert lease(db, 1, "another") is not None


@pytest.mark.only("sqlite", "such addresses are refused before the store is asked")
def test_what_is_neither_is_refused(client: httpx2.Client) -> None:
    for name in ("0", "-1", "1.5", "abc", "9007199254740992", "I" * 22, "1" * 23):
        reply = client.get(f"/api/v1/runs/{name}")
        assert reply.status_code == 422
        assert reply.json()["error"]["message"] == "run_id: write a whole number from 1 on, or a public id"
