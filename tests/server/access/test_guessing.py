"""Guessing is slowed, address by address; whoever is known is asked for nothing more."""

from __future__ import annotations

from collections.abc import Callable

import httpx2
import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient

from parenting.server.access import lookup, tokens
from parenting.server.access.guessing import ADDRESSES, AT_ONCE, Guesses
from parenting.server.access.roles import Role
from parenting.server.access.secret import draw
from parenting.server.audit.entries import entries
from parenting.server.db import Database
from parenting.server.entrance import Entrance
from parenting.server.errors import TooManyGuessesError
from parenting.server.settings import Settings
from parenting.server.tables import Run
from tests.access import session

pytestmark = pytest.mark.only("sqlite", "the store is asked the same on both")

PUBLIC = Settings(public=True, hosts="parenting.example", trusted_proxies="127.0.0.1")


class Time:
    """Stands still until it is moved."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def app(client: httpx2.Client) -> FastAPI:
    """The application, for which no time passes."""
    found: FastAPI = client.app  # type: ignore[attr-defined]
    found.state.door.guesses = Guesses(Time())
    return found


@pytest.fixture
def looks(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The hashes that the database was asked for."""
    asked, find = [], lookup.find

    def counted(session: object, way: object, hashed: str, *rest: object) -> object:
        asked.append(hashed)
        return find(session, way, hashed, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(lookup, "find", counted)
    return asked


def bearer(client: httpx2.Client, secret: str) -> httpx2.Response:
    return client.get("/api/v1/runs", headers={"Authorization": f"Bearer {secret}"})


def by_cookie(client: httpx2.Client, cookie: dict[str, str]) -> int:
    (name, value), *_ = cookie.items()
    return client.get("/api/v1/runs", auth=None, headers={"Cookie": f"{name}={value}"}).status_code


def is_refused(guesses: Guesses, client: str) -> bool:
    try:
        guesses.require(client)
    except TooManyGuessesError:
        return True
    return False


def spend(guesses: Guesses, client: str) -> None:
    for _ in range(AT_ONCE):
        guesses.wrong(client)


def test_an_address_has_some_guesses_and_then_one_a_second() -> None:
    time = Time()
    guesses = Guesses(time)
    spend(guesses, "192.0.2.1")
    assert (is_refused(guesses, "192.0.2.1"), is_refused(guesses, "192.0.2.2")) == (True, False)
    time.now += 1.0
    assert not is_refused(guesses, "192.0.2.1")
    guesses.wrong("192.0.2.1")
    with pytest.raises(TooManyGuessesError) as refused:
        guesses.require("192.0.2.1")
    assert refused.value.seconds == 1
    time.now += 10 * AT_ONCE
    spend(guesses, "192.0.2.1")
    assert is_refused(guesses, "192.0.2.1"), "what was not used is not saved up"


def test_a_network_of_ipv6_is_one_address_and_memory_is_bounded() -> None:
    guesses = Guesses(Time())
    for number in range(AT_ONCE):
        guesses.wrong(f"2001:db8::{number:x}")
    assert (is_refused(guesses, "2001:db8::ffff"), is_refused(guesses, "2001:db8:0:1::1")) == (True, False)
    for number in range(3 * ADDRESSES):
        guesses.wrong(f"10.{number >> 16}.{number >> 8 & 255}.{number & 255}")
    assert len(guesses._left) == ADDRESSES


def test_a_hundred_wrong_tokens_cost_thirty_looks_and_nobody_else_anything(
    client: httpx2.Client, app: FastAPI, db: Database, run: Run, looks: list[str]
) -> None:
    known, token = session(db), tokens.make(db, "program", Role.VIEWER).secret
    assert (by_cookie(client, known), bearer(client, token).status_code) == (200, 200)
    looks.clear()
    replies = [bearer(client, draw("program")) for _ in range(100)]
    assert [reply.status_code for reply in replies] == [401] * AT_ONCE + [429] * (100 - AT_ONCE)
    assert replies[-1].headers["retry-after"] == "1"
    assert replies[-1].json()["error"]["code"] == "guessing"
    assert len(looks) == AT_ONCE
    assert (by_cookie(client, known), bearer(client, token).status_code) == (200, 200)
    assert client.get("/api/v1/runs").status_code == 200, "a proof of the key is not a guess"
    assert len(looks) == AT_ONCE, "who is known is let in without a look"
    app.state.door.forget()
    tokens.revoke(db, tokens.make(db, "program", Role.VIEWER).token.public_id)
    assert by_cookie(client, known) == 200, "who was known is asked for, whatever comes from the address"
    assert len(looks) == AT_ONCE + 1
    elsewhere = TestClient(app, base_url="http://localhost", client=("192.0.2.9", 50_000))
    assert bearer(elsewhere, draw("program")).status_code == 401


def test_a_session_that_ended_is_looked_for_once(
    client: httpx2.Client, app: FastAPI, looks: list[str]
) -> None:
    ended = {app.state.door.cookie: draw("session")}
    assert {by_cookie(client, ended) for _ in range(2 * AT_ONCE)} == {401}
    assert len(looks) == 1
    assert not is_refused(app.state.door.guesses, "testclient")


def test_what_is_no_secret_is_never_looked_for_and_counts(
    client: httpx2.Client, app: FastAPI, looks: list[str]
) -> None:
    statuses = [bearer(client, "' OR 1=1").status_code for _ in range(AT_ONCE + 1)]
    assert (statuses[0], statuses[-1], looks) == (401, 429, [])


@pytest.mark.parametrize("form", [True, False])
def test_wrong_addresses_are_counted_and_then_refused_unread(
    client: httpx2.Client, app: FastAPI, db: Database, monkeypatch: pytest.MonkeyPatch, form: bool
) -> None:
    def guess() -> httpx2.Response:
        secret = {"token": draw("opening")}
        return client.post("/open", data=secret) if form else client.get("/open", params=secret)

    assert [guess().status_code for _ in range(AT_ONCE + 1)] == [410] * AT_ONCE + [429]
    reads: list[Callable[..., object]] = []
    monkeypatch.setattr(db, "read", reads.append)
    monkeypatch.setattr(db, "write", reads.append)
    refused = guess()
    assert (refused.status_code, reads) == (429, [])
    assert "Too many tries" in refused.text


def test_behind_a_proxy_the_client_counts_and_not_what_it_says_of_itself(
    client: httpx2.Client, app: FastAPI, looks: list[str]
) -> None:
    app.state.entrance = Entrance.of(PUBLIC)
    proxied = TestClient(app, base_url="http://parenting.example", client=("127.0.0.1", 50_000))
    proxied.headers["X-Forwarded-Proto"] = "https"

    def guess(chain: str) -> int:
        proxied.headers["X-Forwarded-For"] = chain
        return bearer(proxied, draw("program")).status_code

    forged = [guess(f"203.0.113.{number}, 192.0.2.7") for number in range(AT_ONCE + 1)]
    assert (forged[-2], forged[-1]) == (401, 429)
    assert guess("192.0.2.8") == 401


def test_who_came_in_and_what_was_made_is_in_the_audit_log(
    client: httpx2.Client, app: FastAPI, db: Database, run: Run
) -> None:
    client.post("/access/create", data={"wish": "parent", "run": str(run.id)})
    (link,) = tokens.list_tokens(db)
    client.follow_redirects = False
    made = tokens.make(db, "opening", Role.RESEARCHER)
    client.post("/open", data={"token": made.secret})
    client.auth = None  # type: ignore[assignment]
    client.post(f"/api/v1/runs/{run.id}/pause", headers={"Sec-Fetch-Site": "same-origin"})
    client.post(f"/access/{link.public_id}/revoke")
    client.post("/leave")
    client.get("/access")
    client.post("/open", data={"token": made.secret})
    app.state.refusals.write()
    found = [(row.kind, row.what) for row in reversed(entries(db).rows)]
    assert found == [
        ("token", f"link {link.public_id[:8]} for a parent"),
        ("token", f"address {made.token.public_id[:8]} for a researcher"),
        ("login", f"by address {made.token.public_id[:8]}"),
        ("operator", "pause"),
        ("revocation", f"token {link.public_id[:8]}"),
        ("logout", "left"),
        ("refusal", "unauthenticated"),
        ("refusal", "used_up"),
    ]
    who = [row.who for row in reversed(entries(db).rows)]
    assert who[0] == "researcher by key local"
    assert who[1].startswith("command line (")
    assert who[2].startswith("researcher by session ")
    assert set(who[2:6]) == {who[2]}
    assert set(who[6:]) == {"somebody"}
