"""Requests that nobody thought of, by schemathesis: every reply is one that the API's description foresees.

Well-formed and malformed requests alike, the same ones each time and few: tests/faults/test_schema.py sends
thousands, and others each time. Each operation has a database of its own, with runs and questions in every
state, and most ids that are drawn are led to one of them: else nearly all replies would be 404.
"""

from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from fastapi.responses import JSONResponse
from hypothesis import HealthCheck
from hypothesis import settings as drawn
from schemathesis import Case
from schemathesis.core.failures import FailureGroup
from schemathesis.generation.hypothesis.builder import HypothesisTestConfig, HypothesisTestMode, create_test
from schemathesis.python.asgi import shutdown_lifespans
from structlog.testing import capture_logs

from parenting.server.app import bare_app, create_app
from parenting.server.db import Database
from parenting.server.settings import Settings
from tests.access import bearer
from tests.server.described import description, live, reply_to

EXAMPLES = 3
"""Requests of each kind and operation, besides those that schemathesis lists itself."""
OPERATIONS = [
    (method.upper(), path) for path, found in bare_app().openapi()["paths"].items() for method in found
]
DRAWN = drawn(max_examples=EXAMPLES, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
whole = cache(description)


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    """SQLite's; PostgreSQL gets its share in tests/faults/test_schema.py."""
    return Settings(data=tmp_path, database_url=None)


@pytest.fixture
def replies(settings: Settings, db: Database) -> Iterator[tuple[FastAPI, Counter[int]]]:
    """The application, and what it replied, counted; in the end something must have gone well."""
    live(db)
    seen: Counter[int] = Counter()
    yield create_app(settings, db), seen
    shutdown_lifespans()
    assert any(200 <= status < 300 for status in seen), f"nothing was reached: {seen}"


@pytest.mark.slow_after(6)
@pytest.mark.parametrize(("method", "path"), OPERATIONS)
def test_every_reply_is_foreseen(method: str, path: str, replies: tuple[FastAPI, Counter[int]]) -> None:
    """Requests are drawn here: `schema.parametrize` would draw all of them in each process that collects."""
    app, seen = replies

    def send(case: Case[Any]) -> None:
        seen[reply_to(case, app)] += 1

    config = HypothesisTestConfig(whole().config, modes=list(HypothesisTestMode), explicit_settings=DRAWN)
    create_test(operation=whole()[path][method], test_func=send, config=config)()


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
    case = whole()["/api/v1/runs/{run_id}"]["GET"].Case(path_parameters={"run_id": 1})
    seen[case.call_and_validate(app=app, headers={"Authorization": bearer(80)}).status_code] += 1
    monkeypatch.setattr("parenting.server.api.runs.run_schema", sabotage)
    # structlog's own output may be a file that an earlier test has closed
    with capture_logs(), pytest.raises(FailureGroup, match=found):
        case.call_and_validate(app=app, headers={"Authorization": bearer(80)})
