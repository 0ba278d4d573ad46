"""Thousands of requests that nobody thought of, by schemathesis, others each time: none gets a 5xx (E12).

The description is that of tests/server/test_schema.py, which sends few and always the same. Here one database
and one application meet all of them, so that what a request leaves behind meets the next ones.
"""

from __future__ import annotations

import os
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, Phase, given, seed
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from schemathesis import Case
from schemathesis.core.failures import FailureGroup
from schemathesis.core.result import Ok
from schemathesis.generation import GenerationMode
from schemathesis.python.asgi import shutdown_lifespans

from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.settings import Settings
from parenting.server.workers import sign
from tests.database import database_url
from tests.faults.figures import Figures
from tests.faults.seeds import draws
from tests.lengths import length
from tests.server.described import description, live, reply_to

PARTS = 2
CASES = {"sqlite": length(3000, 22_000) // PARTS, "postgresql": length(300, 3000) // PARTS}
ROUND = {"sqlite": 40, "postgresql": 10}
"""Requests to one operation, then it is the next one's turn."""
MEMORY = Path("/dev/shm")
OPERATIONS = [found.ok() for found in description().get_all_operations() if isinstance(found, Ok)]


@pytest.fixture
def settings(tmp_path: Path, store: str) -> Iterator[Settings]:
    """A data folder in memory where there is such a file system: nothing here is about the disk."""
    at = MEMORY if os.access(MEMORY, os.W_OK) else tmp_path
    with tempfile.TemporaryDirectory(dir=at) as folder, database_url(store) as url:
        yield Settings(data=Path(folder), database_url=url)


@pytest.fixture
def app(settings: Settings, db: Database) -> Iterator[FastAPI]:
    """The application, with runs and questions in every state."""
    live(db)
    yield create_app(settings, db)
    shutdown_lifespans()


@pytest.mark.torture
@pytest.mark.timeout(length(1800, 7200))
@pytest.mark.parametrize("part", range(PARTS))
def test_no_request_gets_a_5xx_and_every_reply_is_foreseen(
    app: FastAPI, store: str, part: int, figures: Figures
) -> None:
    """It takes a minute a part: 3,000 requests to all operations, of which each part has a half."""
    seen: Counter[int] = Counter()
    operations, draw = OPERATIONS[part::PARTS], draws(f"schema {store} {part}")

    def send(case: Case[Any]) -> None:
        seen[reply_to(case, app)] += 1

    while seen.total() < CASES[store]:
        for operation in operations:
            sign(app.state.db, "worker-1")  # without a worker /readyz says 503, as it should
            before = seen.total()
            _send_drawn(operation, send, draw.getrandbits(64), ROUND[store])
            figures.count("requests drawn from the description", operation.label, seen.total() - before)
    assert all(status < 500 for status in seen), seen
    assert min(_hundreds(seen, 2), _hundreds(seen, 4)) > CASES[store] // 10, seen
    sign(app.state.db, "worker-1")
    _goes_on(app)


def _send_drawn(operation: Any, send: Callable[[Case[Any]], None], number: int, count: int) -> None:
    """Draw well-formed and malformed requests to an operation by the number, and send them."""
    cases = st.one_of([operation.as_strategy(generation_mode=mode) for mode in GenerationMode])
    drawn = hypothesis_settings(
        max_examples=count,
        deadline=None,
        database=None,
        phases=[Phase.generate],  # requests change the state, so a smaller one need not fail
        suppress_health_check=list(HealthCheck),
    )
    seed(number)(drawn(given(case=cases)(send)))()


def _hundreds(seen: Counter[int], first: int) -> int:
    return sum(count for status, count in seen.items() if status // 100 == first)


def _goes_on(app: FastAPI) -> None:
    """The usual requests are answered, and the start page opens."""
    with TestClient(app, base_url="http://localhost") as client:
        made = client.post("/api/v1/runs", json={"world": "unsafe-exploration", "name": "afterwards"})
        assert made.status_code == 201
        assert client.get(f"/api/v1/runs/{made.json()['id']}").json()["name"] == "afterwards"
        page = client.get("/", headers={"Accept": "text/html"})
        assert (page.status_code, "afterwards" in page.text) == (200, True)
        assert client.get("/readyz").status_code == 200


@pytest.mark.only("sqlite", "the fault is above the store")
def test_a_fault_of_one_operation_is_found(app: FastAPI, monkeypatch: pytest.MonkeyPatch) -> None:
    (operation,) = [one for one in OPERATIONS if one.label == "GET /api/v1/runs/{run_id}"]
    monkeypatch.setattr("parenting.server.api.runs.run_schema", lambda *_: 1 / 0)

    def send(case: Case[Any]) -> None:
        reply_to(case, app)

    with pytest.raises(FailureGroup, match="Server error"):
        _send_drawn(operation, send, 7, 40)
