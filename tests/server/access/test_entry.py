"""The way in: an address that is opened once becomes a cookie; looking at it changes nothing."""

from __future__ import annotations

import httpx2
import pytest

from parenting.server.access import sessions, tokens
from parenting.server.access.roles import Role
from parenting.server.db import Database
from parenting.server.tables import Run

pytestmark = pytest.mark.only("sqlite", "tests of the sessions are on both stores")


@pytest.fixture(autouse=True)
def still(client: httpx2.Client) -> None:
    client.follow_redirects = False


def enter(client: httpx2.Client, secret: str) -> httpx2.Response:
    return client.post("/open", data={"token": secret})


def test_looking_uses_nothing_up_and_the_form_does(client: httpx2.Client, db: Database) -> None:
    secret = tokens.make(db, "opening", Role.RESEARCHER).secret
    for _ in range(2):
        shown = client.get("/open", params={"token": secret})
        assert (shown.status_code, f'value="{secret}"' in shown.text) == (200, True)
    assert sessions.list_sessions(db) == []
    entered = enter(client, secret)
    assert (entered.status_code, entered.headers["location"]) == (303, "/")
    (cookie,) = entered.headers.get_list("set-cookie")
    assert cookie.startswith("parenting_session_")
    assert {"HttpOnly", "Path=/", "SameSite=lax"} <= set(cookie.split("; "))
    assert "Secure" not in cookie, "this connection is none of TLS"
    assert len(sessions.list_sessions(db)) == 1
    client.cookies.clear()
    for again in (client.get("/open", params={"token": secret}), enter(client, secret)):
        assert again.status_code == 410
        assert "parenting access open" in again.text
    assert len(sessions.list_sessions(db)) == 1


def test_who_presses_twice_is_led_on_and_nothing_begins_or_ends(
    client: httpx2.Client, db: Database, run: Run
) -> None:
    secret, place = tokens.make(db, "opening", Role.RESEARCHER).secret, f"/runs/{run.public_id}/parent"
    enter(client, secret)
    (begun,) = sessions.list_sessions(db)
    looked = client.get("/open", params={"token": secret, "to": place})
    sent = client.post("/open", data={"token": secret, "to": place})
    for again, to in ((looked, place), (sent, place), (enter(client, secret), "/")):
        assert (again.status_code, again.headers["location"]) == (303, to)
        assert "set-cookie" not in again.headers
    assert [one.id for one in sessions.list_sessions(db)] == [begun.id]


def test_the_second_of_two_presses_at_once_offers_the_way_on_and_says_what_a_guess_is_told(
    client: httpx2.Client, db: Database
) -> None:
    """Its cookie is on its way with the first reply."""
    secret = tokens.make(db, "opening", Role.RESEARCHER).secret
    enter(client, secret)
    client.cookies.clear()
    second, guess = enter(client, secret), enter(client, "po_" + "A" * 43)
    assert (second.status_code, second.text) == (410, guess.text)
    assert '<a class="button primary" href="/">Go on</a>' in second.text


@pytest.mark.parametrize("who", ["another role", "whose session has ended", "who guesses"])
def test_a_used_address_leads_nobody_on(client: httpx2.Client, db: Database, run: Run, who: str) -> None:
    secret = tokens.make(db, "opening", Role.RESEARCHER).secret
    enter(client, secret)
    if who == "another role":
        enter(client, tokens.make(db, "link", Role.PARENT, run=run.id).secret)
    elif who == "whose session has ended":
        sessions.end_all(db)
    else:
        secret = "po_" + "A" * 43
    assert client.get("/open", params={"token": secret}).status_code == 410
    assert enter(client, secret).status_code == 410


def test_a_parents_link_leads_to_its_page(client: httpx2.Client, db: Database, run: Run) -> None:
    link = tokens.make(db, "link", Role.PARENT, run=run.id)
    assert enter(client, link.secret).headers["location"] == f"/runs/{run.public_id}/parent"
    viewer = tokens.make(db, "link", Role.VIEWER, run=run.id)
    assert enter(client, viewer.secret).headers["location"] == f"/runs/{run.public_id}"


def test_entering_again_ends_the_former_session_and_leaving_the_last(
    client: httpx2.Client, db: Database
) -> None:
    for _ in range(2):
        enter(client, tokens.make(db, "opening", Role.RESEARCHER).secret)
        assert len(sessions.list_sessions(db)) == 1
    assert client.post("/leave").status_code == 303
    assert sessions.list_sessions(db) == []


@pytest.mark.parametrize("secret", ["", "x", "po_" + "A" * 43, "ps_" + "A" * 43, "é" * 46])
def test_a_guess_opens_nothing(client: httpx2.Client, secret: str) -> None:
    assert client.get("/open", params={"token": secret}).status_code == 410
    assert enter(client, secret).status_code in (410, 422)


def test_another_site_cannot_let_a_browser_in(client: httpx2.Client, db: Database) -> None:
    secret = tokens.make(db, "opening", Role.RESEARCHER).secret
    refused = client.post("/open", data={"token": secret}, headers={"Sec-Fetch-Site": "cross-site"})
    assert refused.status_code == 403
    assert enter(client, secret).status_code == 303
