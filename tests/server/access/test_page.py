"""The page of links and tokens: it lists who may come in, makes links and tokens, and ends each."""

from __future__ import annotations

import re
from typing import Any

import httpx2
import pytest

from parenting.server.access import sessions, tokens
from parenting.server.access.door import cookie_name
from parenting.server.access.roles import Role
from parenting.server.access.tables import AccessToken
from parenting.server.db import Database
from parenting.server.tables import Run
from tests.access import session

pytestmark = pytest.mark.only("sqlite", "tests of the tokens are on both stores")


def make(client: httpx2.Client, **fields: Any) -> httpx2.Response:
    return client.post("/access/create", data=fields)


def shown(reply: httpx2.Response) -> str:
    found = re.search(r'id="secret"[^>]* value="([^"]+)"', reply.text)
    assert found is not None
    return found[1]


def only(db: Database) -> AccessToken:
    (token,) = tokens.list_tokens(db)
    return token


def test_a_parents_link_is_made_shown_once_and_opens_its_run(
    client: httpx2.Client, db: Database, run: Run
) -> None:
    made = make(client, wish="parent", run=run.public_id, name=" <b>Seat</b> 1 ", days="2")
    link = shown(made)
    assert link.startswith("http://localhost/open?token=pl_")
    assert made.headers["cache-control"] == "no-store"
    token = only(db)
    assert (token.kind, token.role, token.run_id, token.name) == ("link", "parent", run.id, "<b>Seat</b> 1")
    assert (token.expires - token.created).days == 2
    assert token.made_by.startswith("researcher by key")
    listed = client.get("/access").text
    assert "<bdi>&lt;b&gt;Seat&lt;/b&gt; 1</bdi>" in listed
    assert "<td>free</td>" in listed
    assert link.partition("token=")[2] not in listed
    assert str(token.client_id) not in listed, "the name of a link lets others answer as this person"
    client.follow_redirects = False
    entered = client.post("/open", data={"token": link.partition("token=")[2]})
    assert entered.headers["location"] == f"/runs/{run.public_id}/parent"
    assert "<td>taken</td>" in client.get("/access").text


def test_others_reach_all_runs_unless_one_is_named(client: httpx2.Client, db: Database) -> None:
    for wish, kind, role in (
        ("viewer", "link", "viewer"),
        ("scrape", "program", "viewer"),
        ("program", "program", "researcher"),
    ):
        made = make(client, wish=wish)
        token = only(db)
        assert (token.kind, token.role, token.run_id, token.client_id) == (kind, role, None, None)
        assert shown(made).startswith("http://" if kind == "link" else "pt_")
        assert "all runs" in client.get("/access").text
        tokens.revoke(db, token.public_id)


WRONG = (
    ({"wish": "parent"}, "run", "Name the run that the parent answers."),
    ({"wish": "parent", "run": "99"}, "run", "There is no such run."),
    ({"wish": "parent", "run": "first"}, "run", "Write a whole number from 1 on"),
    ({"wish": "viewer", "days": "0"}, "days", "Write a number above 0"),
    ({"wish": "viewer", "days": "nan"}, "days", "Write a number above 0"),
    ({"wish": "viewer", "days": "soon"}, "days", "Write a number above 0"),
    ({"wish": "viewer", "name": "\u200b"}, "name", "Nothing of this can be seen"),
    ({"wish": "god"}, "wish", "Choose one of the list."),
)


def test_a_wrong_field_is_named_and_nothing_is_made(client: httpx2.Client, db: Database) -> None:
    for fields, field, message in WRONG:
        refused = make(client, **fields)
        assert refused.status_code == 422, fields
        error = re.search(rf'id="{field}-error">([^<]+)<', refused.text)
        assert error is not None, fields
        assert message in error[1]
        assert "made-title" not in refused.text
    assert tokens.list_tokens(db) == []


def test_revoking_ends_the_link_and_the_browser_that_came_in_by_it(
    client: httpx2.Client, db: Database, run: Run
) -> None:
    link = tokens.make(db, "link", Role.PARENT, run=run.id, name="Seat 1")
    entered = sessions.enter(db, link.secret)
    cookie = f"{cookie_name(db)}={entered.secret}"
    parents, client.follow_redirects = f"/runs/{run.public_id}/parent", False

    def looks() -> int:
        return client.get(parents, auth=None, headers={"Cookie": cookie}).status_code

    assert looks() == 200
    name = link.token.public_id
    assert client.post(f"/access/{name}/revoke").headers["location"] == "/access"
    assert looks() == 401
    assert (tokens.list_tokens(db), sessions.list_sessions(db)) == ([], [])
    assert client.post(f"/access/{name[::-1]}/revoke").status_code == 404
    another_site = {"Sec-Fetch-Site": "cross-site"}
    assert client.post(f"/access/{name}/revoke", headers=another_site).status_code == 403


def test_the_own_session_leaves_and_an_idle_one_is_not_listed(
    client: httpx2.Client, db: Database, clock: Any
) -> None:
    session(db)
    clock.pass_seconds(8 * 24 * 3600)
    client.cookies.update(session(db))
    client.auth = None  # type: ignore[assignment]
    listed = client.get("/access").text
    assert listed.count("this browser") == 1
    assert listed.count('action="/leave"') == 1
    assert "/revoke" not in listed


def test_many_links_are_one_page(client: httpx2.Client, db: Database, monkeypatch: Any) -> None:
    monkeypatch.setattr("parenting.server.reads.access.MOST", 3)
    for _ in range(5):
        tokens.make(db, "link", Role.VIEWER)
    listed = client.get("/access").text
    assert listed.count(">Revoke</button>") == 3
    assert "2 more: <code>parenting access list</code>" in listed
