"""The store refuses at every n-th statement and commit of every request (A3, D2, D4, E12).

The reply is 503 or 507 with a sentence, never 500; sent again, the same request is answered; nothing is lost,
doubled or half done. An error after a commit that succeeded is the hard case: the client resends and learns.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any, NamedTuple

import httpx2
import pytest
from fastapi.testclient import TestClient

from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.settings import Settings
from tests.faults import tap
from tests.faults.auditor import Store, audit
from tests.faults.figures import Figures
from tests.faults.ledger import Entries, Told
from tests.faults.refusals import REFUSALS, Refuse, error_of
from tests.lengths import length
from tests.server.conftest import CLIPS

pytestmark = [pytest.mark.torture, pytest.mark.timeout(length(1800, 3000))]
KINDS = length(3, 9)
"""Kinds of refusals at each statement; the torture tries all."""
CLIENT = "client"


class Request(NamedTuple):
    """A request: `{query}` and `{run}` stand for ids."""

    name: str
    method: str
    path: str
    body: dict[str, Any] | None = None


NEW = {"world": "unsafe-exploration"}
REQUESTS = [
    Request("start", "POST", "/api/v1/runs", NEW),
    Request("lease", "POST", "/api/v1/runs/{run}/queries/lease", {"client_id": CLIENT}),
    Request("answer", "POST", "/api/v1/queries/{query}/answer", {"client_id": CLIENT, "choice": "left"}),
    Request("release", "POST", "/api/v1/queries/{query}/release", {"client_id": CLIENT}),
    Request("pause", "POST", "/api/v1/runs/{run}/pause"),
    Request("resume", "POST", "/api/v1/runs/{run}/resume"),
    Request("event", "POST", "/api/v1/runs/{run}/end-episode"),
    Request("list", "GET", "/api/v1/runs"),
    Request("look", "GET", "/api/v1/runs/{run}"),
    Request("questions", "GET", "/api/v1/runs/{run}/queries"),
    Request("start page", "GET", "/"),
    Request("dashboard", "GET", "/runs/{run}"),
    Request("history", "GET", "/runs/{run}/history"),
    Request("parent's page", "GET", "/runs/{run}/parent"),
]


@pytest.fixture
def web(settings: Settings, db: Database) -> Iterator[httpx2.Client]:
    """The application in this process; an error that nothing handles is a reply of 500."""
    app = create_app(settings, db)
    with TestClient(app, base_url="http://localhost", raise_server_exceptions=False) as caller:
        yield caller


@pytest.mark.parametrize("request_", REQUESTS, ids=lambda one: one.name)
def test_refusal_at_every_statement_of_a_request(
    store: str,
    web: httpx2.Client,
    db: Database,
    mine: Claim,
    kept: Store,
    rng: random.Random,
    figures: Figures,
    request_: Request,
) -> None:
    told, tick = list[Told](), 0
    for when in ("before", "after"):
        place, raised = 1, True
        while raised:
            raised = False
            for refusal in rng.sample(REFUSALS[store], min(KINDS, len(REFUSALS[store]))):
                tick += 1
                query = post_query(db, mine, tick, "guidance", 1, CLIPS)
                refuse = Refuse(place, error_of(store, refusal), when)
                names = {"query": query, "run": mine.run_id}
                with tap.listening(refuse):
                    reply = send(web, request_, names)
                if refuse.raised:
                    raised = True
                    figures.count("statements of the web refused", f"{when}: {refusal.name or 'connection'}")
                    fine = reply.is_success or reply.status_code in (503, 507)
                    assert fine, f"{refuse.act}, {refusal.name}: {reply.status_code} {reply.text[:300]}"
                    assert reply.is_success or "Traceback" not in reply.text
                    reply = send(web, request_, names)
                assert reply.is_success, f"sent again: {reply.status_code} {reply.text[:300]}"
                if request_.name == "answer":
                    one = reply.json()
                    told.append(
                        Told(str(one["query"]), str(one["run"]), one["number"], one["choice"], CLIENT)
                    )
            place += 1
    assert audit(kept, Entries(told, [])) == []


def send(web: httpx2.Client, request: Request, names: dict[str, int]) -> httpx2.Response:
    """The reply; a form or page that leads elsewhere is followed."""
    path = request.path.format(**names)
    return web.request(request.method, path, json=request.body, follow_redirects=True)
