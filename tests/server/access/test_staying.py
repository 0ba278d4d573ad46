"""Streams and requests that wait for a question end with the right to them."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import httpx2
import pytest
from fastapi import FastAPI
from starlette.requests import Request

from parenting.server.access import lookup, sessions, staying, tokens
from parenting.server.access.roles import LOCAL, Role
from parenting.server.access.staying import Stay
from parenting.server.db import Database
from parenting.server.errors import BusyError
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.tables import Run
from tests.access import session
from tests.server.conftest import CLIPS, Clock

pytestmark = pytest.mark.only("sqlite", "what is revoked is the same on both stores")

DAY = 24 * 3600.0


@pytest.fixture(autouse=True)
def often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(staying, "SECONDS", 0.01)
    monkeypatch.setattr("parenting.server.access.door.FRESH_SECONDS", 0.0)


def until(true: Callable[[], bool]) -> None:
    end = time.monotonic() + 30
    while not true():
        assert time.monotonic() < end
        time.sleep(0.005)


def by_token(db: Database, run: Run) -> tuple[dict[str, str], Callable[[], None]]:
    made = tokens.make(db, "program", Role.PARENT, run=run.id, days=3)
    return bearer(made.secret), lambda: tokens.revoke(db, made.token.public_id)


def by_link(db: Database, run: Run) -> tuple[dict[str, str], Callable[[], None]]:
    made = tokens.make(db, "link", Role.PARENT, run=run.id, days=3)
    entered = sessions.enter(db, made.secret)
    return cookie(db, entered.secret), lambda: tokens.revoke(db, made.token.public_id)


def by_session(db: Database, run: Run) -> tuple[dict[str, str], Callable[[], None]]:
    entered = sessions.enter(db, tokens.make(db, "opening", Role.RESEARCHER).secret)
    return cookie(db, entered.secret), lambda: sessions.end(db, entered.secret)


def bearer(secret: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {secret}"}


def cookie(db: Database, secret: str) -> dict[str, str]:
    (name,) = session(db)
    return {"Cookie": f"{name}={secret}"}


def follow(caller: httpx2.Client, run: Run, headers: dict[str, str]) -> httpx2.Response:
    return caller.get(f"/api/v1/runs/{run.public_id}/events", headers=headers)


def carry(caller: httpx2.Client, run: Run, headers: dict[str, str]) -> httpx2.Response:
    name = caller.get(f"/runs/{run.public_id}/parent", headers=headers).text.partition('data-client="')[2]
    page = {"run": run.public_id, "client_id": name.partition('"')[0], "shown": [], "asks": False}
    return caller.post("/runs/parent/stream", headers=headers, json={"pages": [page]})


WAYS = {
    "a token": (by_token, carry),
    "a link": (by_link, carry),
    "a session": (by_session, carry),
    "a session that follows": (by_session, follow),
}


@pytest.mark.parametrize("name", WAYS)
def test_a_stream_ends_when_what_opened_it_is_revoked_and_no_other_does(
    name: str, stranger: httpx2.Client, app: FastAPI, db: Database, run: Run
) -> None:
    (enter, read), streams = WAYS[name], app.state.streams
    (mine, revoke), (other, _) = enter(db, run), enter(db, run)
    with ThreadPoolExecutor() as pool, closing(streams):
        ended, lasting = (pool.submit(read, stranger, run, headers) for headers in (mine, other))
        until(lambda: streams.number() == 2)
        revoke()
        assert ended.result(30).status_code == 200
        assert (streams.number(), lasting.done()) == (1, False)
        streams.close()
        assert lasting.result(30).status_code == 200
    assert stranger.get(f"/runs/{run.public_id}/parent", headers=mine).status_code == 401


def test_a_stream_ends_when_what_opened_it_expires(
    stranger: httpx2.Client, app: FastAPI, db: Database, run: Run, clock: Clock
) -> None:
    headers, _ = by_token(db, run)
    with ThreadPoolExecutor() as pool, closing(app.state.streams):
        reply = pool.submit(carry, stranger, run, headers)
        until(lambda: app.state.streams.number() == 1)
        clock.pass_seconds(3.1 * DAY)
        assert reply.result(30).status_code == 200


def test_who_waits_for_a_question_gets_none_once_revoked(
    stranger: httpx2.Client, app: FastAPI, db: Database, mine: Claim
) -> None:
    made = tokens.make(db, "program", Role.PARENT, run=mine.run_id)
    waiting = app.state.streams.subscriptions

    def ask() -> httpx2.Response:
        body, headers = {"client_id": made.token.client_id, "wait": 10}, bearer(made.secret)
        return stranger.post(f"/api/v1/runs/{mine.run_id}/queries/lease", json=body, headers=headers)

    with ThreadPoolExecutor() as pool:
        reply = pool.submit(ask)
        until(lambda: reply.done() or any(one.requests for one in [*waiting.values()]))
        tokens.revoke(db, made.token.public_id)
        post_query(db, mine, 1, "guidance", 1, CLIPS)
        assert reply.result(40).status_code == 204


def stay(app: FastAPI, headers: dict[str, str]) -> Stay:
    """Of a request that the guard has let in."""
    sent = [(name.lower().encode(), value.encode()) for name, value in headers.items()]
    request = Request({"type": "http", "app": app, "headers": sent, "client": ("192.0.2.1", 1)})
    who = asyncio.run(app.state.door.principal(request))
    request.state.principal = who or LOCAL
    return Stay(request)


def test_asking_again_costs_no_query_each(
    app: FastAPI, db: Database, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(staying, "SECONDS", 0.0)
    monkeypatch.setattr("parenting.server.access.door.FRESH_SECONDS", 3600.0)
    stays = [stay(app, by_token(db, run)[0]) for _ in range(20)]
    asked: list[object] = []
    monkeypatch.setattr(lookup, "find", lambda *given: asked.append(given))

    async def all_of_them() -> list[bool]:
        return [await one.is_over() for one in stays]

    assert (asyncio.run(all_of_them()), asked) == ([False] * 20, [])


def test_nobody_is_sent_away_while_the_database_cannot_be_read_nor_who_has_the_key(
    app: FastAPI, db: Database, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(staying, "SECONDS", 0.0)
    known, local = stay(app, by_token(db, run)[0]), stay(app, {})

    async def busy(_request: object) -> None:
        raise BusyError

    monkeypatch.setattr(app.state.door, "principal", busy)
    assert asyncio.run(known.is_over()) is False
    assert asyncio.run(local.is_over()) is False
