"""The stranger's attempts, one by one: each is refused, and the reply does not tell what is there."""

from __future__ import annotations

import httpx2
import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from sqlalchemy import select

from parenting.server import runs
from parenting.server.access import sessions, tokens
from parenting.server.access.door import cookie_name
from parenting.server.access.roles import Role
from parenting.server.access.secret import draw
from parenting.server.db import Database
from parenting.server.entrance import Entrance
from parenting.server.persons import name_person, pseudonyms
from parenting.server.public_ids import public_id
from parenting.server.queue.answers import Said, answer_in
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from parenting.server.tables import Answer, Run
from tests.server.access.house import House, send
from tests.server.conftest import Clock

pytestmark = pytest.mark.only("sqlite", "whoever is refused is refused before the store is asked")


def standing(db: Database, query: int) -> Answer | None:
    with db.read() as session:
        return session.scalar(select(Answer).where(Answer.query_id == query))


def test_whether_something_is_there_is_not_told(stranger: httpx2.Client, house: House) -> None:
    missing = public_id()
    for there, absent in (
        (f"/api/v1/runs/{house.run.id}", "/api/v1/runs/99"),
        (f"/api/v1/runs/{house.run.public_id}", f"/api/v1/runs/{missing}"),
        (f"/api/v1/queries/{house.question}", f"/api/v1/queries/{missing}"),
        (f"/api/v1/jobs/{house.job}", f"/api/v1/jobs/{missing}"),
        (f"/runs/{house.run.public_id}/parent", f"/runs/{missing}/parent"),
        (f"/runs/{house.run.id}/history", "/runs/99/history"),
    ):
        for who in ("stranger", "parent of another run"):
            bearer = house.bearers[who]
            one, other = send(stranger, "GET", there, bearer), send(stranger, "GET", absent, bearer)
            assert one.status_code == other.status_code == (401 if bearer is None else 403), there
            assert one.text == other.text


def test_a_parent_reaches_no_question_that_another_holds(
    stranger: httpx2.Client, house: House, db: Database, guidance: int
) -> None:
    second = {"Authorization": str(house.bearers["second parent"])}
    path = f"/api/v1/queries/{house.question}"
    said = {"choice": "left", "client_id": "me"}
    assert stranger.get(path, headers=second).status_code == 403
    assert stranger.post(f"{path}/answer", json=said, headers=second).status_code == 403
    assert standing(db, guidance) is None
    first = {"Authorization": str(house.bearers["parent"])}
    assert stranger.get(path, headers=first).status_code == 200
    refused = stranger.post(f"{path}/answer", json=said, headers=first)
    assert (refused.status_code, standing(db, guidance)) == (403, None), "under another name"


def test_a_parents_stream_is_of_their_own_run(stranger: httpx2.Client, house: House) -> None:
    page = {"run": house.run.public_id, "client_id": "me", "shown": [], "asks": False}
    for who, run in (("parent of another run", house.run), ("parent", house.other)):
        bearer = {"Authorization": str(house.bearers[who])}
        body = {"pages": [{**page, "run": run.public_id}]}
        assert stranger.post("/runs/parent/stream", json=body, headers=bearer).status_code == 403


def test_a_parent_operates_nothing(stranger: httpx2.Client, house: House, db: Database) -> None:
    for who in ("parent", "viewer"):
        for verb in ("pause", "stop", "delete"):
            path = f"/api/v1/runs/{house.run.id}/{verb}"
            assert send(stranger, "POST", path, house.bearers[who]).status_code == 403
    assert runs.get_run(db, house.run.id).status is RunStatus.ACTIVE


def test_links_that_open_nothing_are_refused_alike(
    stranger: httpx2.Client, db: Database, run: Run, clock: Clock
) -> None:
    expired = tokens.make(db, "link", Role.PARENT, run=run.id, days=1).secret
    clock.pass_seconds(2 * 24 * 3600)
    revoked = tokens.make(db, "link", Role.PARENT, run=run.id)
    tokens.revoke(db, revoked.token.public_id)
    replayed = tokens.make(db, "opening", Role.RESEARCHER).secret
    assert stranger.post("/open", data={"token": replayed}).status_code == 303
    stranger.cookies.clear()
    token = tokens.make(db, "program", Role.RESEARCHER).secret
    texts = set()
    for secret in (draw("link"), expired, revoked.secret, replayed, token, "guess"):
        refused = stranger.post("/open", data={"token": secret})
        assert (refused.status_code, "set-cookie" in refused.headers) == (410, False)
        texts |= {refused.text, stranger.get("/open", params={"token": secret}).text}
    assert len(texts) == 1, "a page says neither which it was nor that it ever was one"
    assert len(sessions.list_sessions(db)) == 1


def test_another_site_acts_for_nobody(stranger: httpx2.Client, house: House, db: Database) -> None:
    path = f"/runs/{house.run.public_id}/status"
    for headers in (
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
        {"Origin": "http://localhost.evil.example"},
        {"Origin": "null"},
    ):
        bearer = {"Authorization": str(house.bearers["researcher"])}
        refused = stranger.post(path, data={"status": "paused"}, headers={**bearer, **headers})
        assert refused.status_code == 403, headers
    assert runs.get_run(db, house.run.id).status is RunStatus.ACTIVE


def test_what_a_client_says_of_itself_opens_nothing(
    stranger: httpx2.Client, app: FastAPI, house: House
) -> None:
    forged = {"X-Forwarded-For": "127.0.0.1", "X-Forwarded-Proto": "https", "X-Forwarded-Host": "localhost"}
    more = {"Forwarded": "for=127.0.0.1;host=localhost;proto=https", "X-Real-IP": "127.0.0.1"}
    assert stranger.get("/", headers={**forged, **more}).status_code == 401
    app.state.entrance = Entrance.of(
        Settings(public=True, hosts="parenting.example", trusted_proxies="127.0.0.1")
    )
    outside = TestClient(app, base_url="http://parenting.example", client=("192.0.2.9", 50_000))
    bearer = str(house.bearers["researcher"])
    refused = outside.get("/", auth=None, headers={**forged, **more, "Authorization": bearer})
    assert (refused.status_code, "https" in refused.text) == (403, True)


@pytest.mark.parametrize("peer", ["testclient", "127.0.0.1"])
def test_another_name_or_none_is_refused_whoever_asks(
    stranger: httpx2.Client, app: FastAPI, house: House, peer: str
) -> None:
    caller = TestClient(app, base_url="http://localhost", client=(peer, 50_000))
    bearer = str(house.bearers["researcher"])
    for host in (
        "evil.example",
        "localhost.evil.example",
        "localhost@evil.example",
        "local host",
        "[::1",
        "",
    ):
        reply = caller.get("/api/v1/runs", headers={"Host": host, "Authorization": bearer}, auth=None)
        assert (reply.status_code, reply.json()["error"]["code"]) == (400, "unknown_host"), host


def test_a_planted_cookie_becomes_nobodys_session(stranger: httpx2.Client, db: Database) -> None:
    planted = draw("session")
    name = cookie_name(db)
    plant = {"Cookie": f"{name}={planted}"}
    assert stranger.get("/", headers=plant).status_code == 401
    secret = tokens.make(db, "opening", Role.RESEARCHER).secret
    entered = stranger.post("/open", data={"token": secret}, headers=plant)
    assert entered.status_code == 303
    assert planted not in entered.headers["set-cookie"]
    stranger.cookies.clear()
    assert stranger.get("/", headers=plant).status_code == 401


def test_a_parent_and_a_viewer_see_nothing_of_other_persons(
    stranger: httpx2.Client, house: House, db: Database, guidance: int
) -> None:
    seen = {"shown": 1_795_950_000_123, "reacted": 812, "answered": 987_654, "away": 123_457, "layout": "one"}
    with db.write() as session:
        answer_in(session, db, guidance, Said("left", "the-cookie-of-bea", "human", 1, seen))
    bea = pseudonyms(db, ["the-cookie-of-bea"])["the-cookie-of-bea"]
    name_person(db, bea, "Beatrix Example", "ext-77")
    hidden = ("the-cookie-of-bea", bea, "Beatrix", "ext-77", "123457", "123,457", "987654")
    run = house.run.public_id
    paths = {
        "parent": [f"/runs/{run}/history", f"/runs/{run}/parent", f"/api/v1/runs/{run}"],
        "viewer": [
            "/",
            f"/runs/{run}",
            f"/runs/{run}/why",
            f"/api/v1/runs/{run}",
            "/api/v1/runs",
            "/metrics",
        ],
    }
    for who, pages in paths.items():
        for page in pages:
            shown = send(stranger, "GET", page, house.bearers[who])
            assert shown.status_code == 200, (who, page)
            assert [text for text in hidden if text in shown.text] == [], (who, page)
        assert send(stranger, "GET", "/persons", house.bearers[who]).status_code == 403
        assert send(stranger, "GET", "/audit", house.bearers[who]).status_code == 403
