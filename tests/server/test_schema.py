"""Requests that nobody thought of, by schemathesis: every reply is one that the API's description foresees.

Well-formed and malformed requests alike, the same ones each time. Each operation has a database of its own,
with runs and questions in every state, and most ids that are drawn are led to one of them: else nearly all
replies would be 404.
"""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest
import schemathesis
from fastapi import FastAPI
from fastapi.responses import JSONResponse
from hypothesis import HealthCheck, settings
from schemathesis import Case
from schemathesis.core.failures import FailureGroup
from schemathesis.python.asgi import shutdown_lifespans
from schemathesis.specs.openapi.checks import positive_data_acceptance
from sqlalchemy import select
from structlog.testing import capture_logs

from parenting.server.app import bare_app, create_app
from parenting.server.db import Database
from parenting.server.metrics import write_metrics
from parenting.server.new_run import LARGEST_INT, NewRun, start
from parenting.server.operator_events import add_operator_event
from parenting.server.public_ids import is_public_id
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query, take_answer, take_operator_events
from parenting.server.runs import Claim, claim, finish, set_status
from parenting.server.settings import Settings
from parenting.server.statuses import RunStatus
from parenting.server.tables import Query, Run
from parenting.server.workers import sign
from tests.server.conftest import CLIPS

EXAMPLES = 20
"""Requests of each kind and operation, besides those that schemathesis lists itself."""
RUNS, QUESTIONS = 4, 8
UNTOLD: dict[str, list[Any]] = {"start_run": [positive_data_acceptance]}
"""Rules that a schema cannot hold: which levels, presets and settings there are, and which go together."""


@pytest.fixture
def lived(db: Database) -> None:
    """Runs 1 and 4 live, 2 was stopped, 3 has failed. Questions of run 1 are applied, answered and open."""
    for _ in range(RUNS):
        start(db, NewRun(world="unsafe-exploration", config={"stages": 3}, name="schema"))
    mine, _, third, _ = claim(db, "worker-1")
    set_status(db, 2, RunStatus.STOPPED, "Stopped by the operator.")
    finish(db, third, RunStatus.FAILED, "It could not go on.")
    _live(db, mine)
    sign(db, "worker-1")


def _live(db: Database, mine: Claim) -> None:
    kinds = ("guidance", "preference")
    queries = [post_query(db, mine, tick, kinds[tick % 2], 1, CLIPS, (1, tick)) for tick in range(QUESTIONS)]
    answer(db, queries[0], "left", "a", "human")
    take_answer(db, mine, QUESTIONS)
    answer(db, queries[1], "neither", "a", "human")
    add_operator_event(db, mine.run_id, "change", {"kind": "change", "name": "p_rec", "value": 0.5})
    take_operator_events(db, mine, QUESTIONS + 1)
    add_operator_event(db, mine.run_id, "mature", {"kind": "mature"})
    write_metrics(db, mine, {tick: {"deaths": 0, "loss": None} for tick in range(5)})


@pytest.fixture
def replies(settings: Settings, db: Database, lived: None) -> Iterator[tuple[FastAPI, Counter[int]]]:
    """The application, and what it replied, counted; in the end something must have gone well."""
    seen: Counter[int] = Counter()
    yield create_app(settings, db), seen
    shutdown_lifespans()
    assert any(200 <= status < 300 for status in seen), f"nothing was reached: {seen}"


SCHEMA = schemathesis.openapi.from_dict(bare_app().openapi())
SCHEMA.config.update(base_url="http://localhost")
# a well-formed answer may be meant for another database
SCHEMA.config.checks.positive_data_acceptance.expected_statuses.append("410")
SCHEMA.config.max_stream_events = 1  # a live stream has no end


@SCHEMA.parametrize()
@settings(max_examples=EXAMPLES, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
def test_every_reply_is_foreseen(case: Case[Any], replies: tuple[FastAPI, Counter[int]]) -> None:
    app, seen = replies
    _lead(case, app.state.db)
    reply = case.call_and_validate(app=app, excluded_checks=UNTOLD.get(_name(case), []))
    seen[reply.status_code] += 1


def _name(case: Case[Any]) -> str:
    return str(case.operation.definition.raw["operationId"])


def _lead(case: Case[Any], db: Database) -> None:
    """Well-formed ids lead to what is there, and one in so many beyond; malformed ones stay as they are."""
    for name, count, table in (("run_id", RUNS, Run), ("query_id", QUESTIONS, Query)):
        drawn = case.path_parameters.get(name)
        if isinstance(drawn, str) and is_public_id(drawn) and drawn[0] not in "12345":
            case.path_parameters[name] = _public_id(db, table, 1 + ord(drawn[0]) % count)
        if type(drawn) is int and 0 < drawn <= LARGEST_INT:
            case.path_parameters[name] = 1 + drawn % (count + 1)


def _public_id(db: Database, table: type[Run] | type[Query], number: int) -> str:
    with db.read() as session:
        return session.execute(select(table.public_id).where(table.id == number)).scalar_one()


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
