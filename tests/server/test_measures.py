"""Measures of an answer, which the page takes, are stored with it, checked, hashed and shown."""

from __future__ import annotations

from typing import Any

import httpx2
import pytest
from sqlalchemy import text

from parenting.server.chain import check
from parenting.server.db import Database
from parenting.server.measures import FIELDS, Measured, shorten, whole
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.reads.answers import every
from parenting.server.runs import Claim
from tests.pages.parent_page import address, form
from tests.server.conftest import CLIPS

SEEN: dict[str, Any] = {
    **{"shown": 1795950000123, "reacted": 812, "answered": 1450, "queued": 3, "away": 0},
    **{"layout": "two", "sides": "left-right", "width": 1280, "height": 800},
    **{"input": "key", "wording": "3f9a12bc"},
}
NOTHING = dict.fromkeys(FIELDS)


def stored(db: Database) -> list[dict[str, Any] | None]:
    return [row.answer.measured for row in every(db, 1)]


def say(client: httpx2.Client, query: int, measured: Any, verb: str = "answer", **more: Any) -> int:
    body = {"client_id": "tab", "measured": measured, **more}
    return client.post(f"/api/v1/queries/{query}/{verb}", json=body).status_code


def test_measures_are_stored_shown_and_hashed(db: Database, client: httpx2.Client, guidance: int) -> None:
    assert say(client, guidance, SEEN, choice="left") == 200
    assert stored(db) == [SEEN]
    shown = client.get(f"/api/v1/queries/{guidance}").json()["answer"]
    given = client.get(f"/api/v1/queries/{guidance}/why").json()["answers"][0]
    assert shown["measured"] == given["measured"] == SEEN
    said = "first reaction after 0.81 s, answered after 1.45 s, sent 0.00 s later, tab not left, by key"
    assert said in client.get(address(db).replace("/parent", "/history")).text
    assert check(db, 1).problems == []
    with db.write() as session:
        session.execute(text("UPDATE answer SET measured = replace(measured, '1450', '1451')"))
    assert check(db, 1).problems == ["answer 1 or its question was changed"]


def test_a_change_and_a_skip_have_measures_of_their_own(
    db: Database, client: httpx2.Client, mine: Claim, guidance: int
) -> None:
    assert say(client, guidance, SEEN, choice="left") == 200
    later = {**SEEN, "answered": 90, "input": "touch"}
    assert say(client, guidance, later, "change", choice="right") == 200
    assert say(client, post_query(db, mine, 9, "preference", 1, CLIPS), NOTHING, "skip") == 200
    assert stored(db) == [SEEN, later, NOTHING]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("shown", -1),
        ("shown", 1.5),
        ("answered", "1450"),
        ("away", 10**12),
        ("layout", "three"),
        ("input", "voice"),
        ("wording", "<script>"),
        ("width", True),
        ("mood", 3),
    ],
)
def test_what_cannot_be_is_refused_and_named(
    db: Database, client: httpx2.Client, guidance: int, name: str, value: object
) -> None:
    body = {"choice": "left", "client_id": "tab", "measured": {**SEEN, name: value}}
    reply = client.post(f"/api/v1/queries/{guidance}/answer", json=body)
    assert reply.status_code == 422
    assert name in reply.text
    assert stored(db) == []


def test_who_measures_nothing_or_little_is_heard(
    db: Database, client: httpx2.Client, mine: Claim, guidance: int
) -> None:
    other = post_query(db, mine, 9, "preference", 1, CLIPS)
    body = {"choice": "left", "client_id": "me"}
    assert client.post(f"/api/v1/queries/{guidance}/answer", json=body).is_success
    assert say(client, other, {"width": 390}, choice="either") == 200
    assert stored(db) == [None, {**NOTHING, "width": 390}]


def test_plain_forms_say_that_they_are_forms(db: Database, client: httpx2.Client, guidance: int) -> None:
    client.follow_redirects = False
    here, fields = address(db), form(db, guidance, client_id="me-without")
    assert client.post(f"{here}/answer", data={**fields, "choice": "left"}).status_code == 303
    change = {**fields, "choice": "right", "replays": "", "measured": ""}
    assert client.post(f"{here}/change", data=change).status_code == 303
    scripted = {**change, "choice": "left", "measured": Measured(**SEEN).model_dump_json()}
    assert client.post(f"{here}/change", data=scripted).status_code == 303
    assert client.post(f"{here}/change", data={**change, "measured": "{"}).status_code == 422
    assert stored(db) == [{**NOTHING, "input": "form"}, {**NOTHING, "input": "form"}, SEEN]


def test_they_take_fifty_bytes_and_come_back(db: Database, mine: Claim, guidance: int) -> None:
    assert len(shorten(SEEN)) <= 50
    for one in (SEEN, NOTHING, {**NOTHING, "away": 0}):
        assert whole(shorten(one)) == one
    answer(db, guidance, "left", "me", "human")
    with db.write() as session:
        session.execute(text("UPDATE answer SET measured = 'who knows'"))
    (row,) = every(db, mine.run_id)
    assert "measures of an answer" in str(row.damage)
