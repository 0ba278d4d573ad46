"""A house with two runs, and a token for each of those who may come to it."""

from __future__ import annotations

import httpx2
import pytest
from fastapi import FastAPI

from parenting.server import jobs
from parenting.server.access import tokens
from parenting.server.access.roles import Role
from parenting.server.access.tables import AccessToken
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue.leases import lease
from parenting.server.runs import Claim
from parenting.server.tables import Query, Run
from tests.server.access.house import House


@pytest.fixture
def house(db: Database, run: Run, mine: Claim, guidance: int) -> House:
    other = start(db, NewRun(world="unsafe-exploration"))
    made = {
        "viewer": tokens.make(db, "program", Role.VIEWER),
        "viewer of another run": tokens.make(db, "program", Role.VIEWER, run=other.id),
        "parent": tokens.make(db, "program", Role.PARENT, run=run.id),
        "second parent": tokens.make(db, "program", Role.PARENT, run=run.id),
        "parent of another run": tokens.make(db, "program", Role.PARENT, run=other.id),
        "researcher": tokens.make(db, "program", Role.RESEARCHER),
    }
    client_id = client_of(made["parent"].token)
    assert lease(db, run.id, client_id) is not None
    job = jobs.ask(db, run.id, "rollout", {"seed": 1}, client_id)
    bearers = {name: f"Bearer {one.secret}" for name, one in made.items()}
    return House(run, other, query_of(db, guidance).public_id, job.public_id, {"stranger": None, **bearers})


def query_of(db: Database, number: int) -> Query:
    with db.read() as session:
        return session.get_one(Query, number)


def client_of(token: AccessToken) -> str:
    assert token.client_id is not None
    return token.client_id


@pytest.fixture
def stranger(client: httpx2.Client) -> httpx2.Client:
    """The client without any credentials."""
    client.auth = None  # type: ignore[assignment]
    client.follow_redirects = False
    return client


@pytest.fixture
def app(stranger: httpx2.Client) -> FastAPI:
    found: FastAPI = stranger.app  # type: ignore[attr-defined]
    return found
