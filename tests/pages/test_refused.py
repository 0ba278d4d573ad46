"""A page of refusal says how to come in, or leads back to where somebody has their work."""

from __future__ import annotations

import re

import httpx2

from parenting.server.access import tokens
from parenting.server.access.roles import Role
from parenting.server.db import Database
from parenting.server.runs import get_run
from tests.access import session
from tests.pages import island_fixtures as fixtures


def looked(client: httpx2.Client, path: str, cookie: dict[str, str] | None = None) -> httpx2.Response:
    header = "; ".join(f"{name}={value}" for name, value in (cookie or {}).items())
    reply: httpx2.Response = client.get(path, auth=None, headers={"Cookie": header} if header else {})
    return reply


def way_on(reply: httpx2.Response) -> str | None:
    found = re.search(r'<a class="button primary" href="([^"]+)"', reply.text)
    return found[1] if found else None


def test_a_stranger_is_told_how_to_come_in(client: httpx2.Client, db: Database) -> None:
    fixtures.start_run(db)
    refused = looked(client, "/")
    assert refused.status_code == 401
    assert refused.headers["www-authenticate"] == "Bearer"
    assert "This browser is not known here" in refused.text
    for told in ("parenting access open", "docker compose exec web parenting access open", "a new one"):
        assert told in refused.text
    assert way_on(refused) is None
    there, absent = looked(client, "/runs/1/parent"), looked(client, "/runs/99/parent")
    assert there.status_code == absent.status_code == 401
    assert there.text == absent.text, "the page does not tell which runs there are"
    assert looked(client, "/api/v1/runs").json()["error"]["code"] == "unauthenticated"


def test_a_link_that_opens_nothing_does_not_say_why(client: httpx2.Client, db: Database) -> None:
    made = tokens.make(db, "link", Role.VIEWER)
    tokens.revoke(db, made.token.public_id)
    revoked, guessed = (
        looked(client, f"/open?token={one}") for one in (made.secret, made.secret[:3] + "A" * 43)
    )
    assert revoked.status_code == guessed.status_code == 410
    assert revoked.text == guessed.text
    assert "parenting access open" in revoked.text


def test_who_may_not_do_this_is_led_back(client: httpx2.Client, db: Database) -> None:
    fixtures.start_run(db)
    run = get_run(db, 1)
    for role, only, way in (
        (Role.PARENT, run.id, f"/runs/{run.public_id}/parent"),
        (Role.VIEWER, run.id, f"/runs/{run.public_id}"),
        (Role.VIEWER, None, "/"),
    ):
        refused = looked(client, "/levels", session(db, role, run=only))
        assert (refused.status_code, way_on(refused)) == (403, way)
        assert "This is not open to you" in refused.text
