"""Requests that nobody thought of, by schemathesis: every reply is one that the API's description foresees.

Well-formed and malformed requests alike, the same ones each time and few: tests/faults/test_schema.py sends
thousands, and others each time. Each operation has a database of its own, with runs and questions in every
state, and most ids that are drawn are led to one of them: else nearly all replies would be 404.
"""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest
from fastapi import FastAPI
from fastapi.responses import JSONResponse
from hypothesis import HealthCheck, settings
from schemathesis import Case
from schemathesis.core.failures import FailureGroup
from schemathesis.python.asgi import shutdown_lifespans
from structlog.testing import capture_logs

from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.settings import Settings
from tests.server.described import description, live, reply_to

EXAMPLES = 3
"""Requests of each kind and operation, besides those that schemathesis lists itself."""
SCHEMA = description()
pytestmark = pytest.mark.only("sqlite", "PostgreSQL gets its share in tests/faults/test_schema.py")


@pytest.fixture
def replies(settings: Settings, db: Database) -> Iterator[tuple[FastAPI, Counter[int]]]:
    """The application, and what it replied, counted; in the end something must have gone well."""
    live(db)
    seen: Counter[int] = Counter()
    yield create_app(settings, db), seen
    shutdown_lifespans()
    assert any(200 <= status < 300 for status in seen), f"nothing was reached: {seen}"


@SCHEMA.parametrize()
@settings(max_examples=EXAMPLES, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
def test_every_reply_is_foreseen(case: Case[Any], replies: tuple[FastAPI, Counter[int]]) -> None:
    app, seen = replies
    seen[reply_to(case, app)] += 1


@pytest.mark.parametrize(
    ("sabotage", "found"),
    [
        (lambda *_: JSONResponse({"id": "one"}), "Response violates schema"),
        (lambda *_: 1 / 0, "Server error"),
    ],
)
def test_what_is_not_foreseen_is_found(
    replies: tuple[FastAPI, Counter[int]], monkeypatch: pytest.MonkeyPatch, sabotage: Any, found: str
) -> None:
    app, seen = replies
    case = SCHEMA["/api/v1/runs/{run_id}"]["GET"].Case(path_parameters={"run_id": 1})
    seen[case.call_and_validate(app=app).status_code] += 1
    monkeypatch.setattr("parenting.server.api.runs.run_schema", sabotage)
    # structlog's own output may be a file that an earlier test has closed
    with capture_logs(), pytest.raises(FailureGroup, match=found):
        case.call_and_validate(app=app)
