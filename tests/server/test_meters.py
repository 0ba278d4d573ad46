"""The figures at /metrics: right, in Prometheus' format, of few labels, and cheap to read."""

from __future__ import annotations

from typing import Any

import httpx2
import pytest
from prometheus_client.parser import text_string_to_metric_families
from sqlalchemy import event, text

from parenting.server.db import Database
from parenting.server.errors import BusyError
from parenting.server.meters import _ANSWERS, _OPEN, _RUNS
from parenting.server.queue.answers import answer
from parenting.server.queue.revisions import supersede
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim, set_status
from parenting.server.statuses import RunStatus
from parenting.server.subscriptions import Subscription
from parenting.server.tables import Run
from parenting.server.workers import sign
from tests.server.conftest import CLIPS, Clock


def figures(client: httpx2.Client) -> dict[tuple[str, tuple[str, ...]], float]:
    """Name and label values -> value, as Prometheus reads them."""
    reply = client.get("/metrics")
    assert reply.status_code == 200
    assert reply.headers["content-type"] == "text/plain; version=0.0.4; charset=utf-8"
    families = text_string_to_metric_families(reply.text)
    samples = [sample for family in families for sample in family.samples]
    return {(sample.name, tuple(sample.labels.values())): sample.value for sample in samples}


def test_requests_are_counted_by_their_route_and_status(client: httpx2.Client, run: Run) -> None:
    for path in (
        f"/api/v1/runs/{run.id}",
        "/api/v1/runs/77",
        "/api/v1/runs/78",
        "/no/such",
        "/static/parent.js",
    ):
        client.get(path)
    client.get("/healthz", headers={"Host": "evil.example"})
    found = figures(client)
    route = "/api/v1/runs/{run_id}"
    assert found["parenting_requests_total", ("GET", route, "200")] == 1
    assert found["parenting_requests_total", ("GET", route, "404")] == 2
    assert found["parenting_requests_total", ("GET", "none", "404")] == 1
    assert found["parenting_requests_total", ("GET", "none", "400")] == 1
    assert found["parenting_requests_total", ("GET", "/static", "200")] == 1
    assert found["parenting_request_seconds_count", (route,)] == 3


@pytest.mark.slow
def test_no_label_grows_with_what_is_asked(client: httpx2.Client) -> None:
    client.get("/metrics")
    before = len(figures(client))
    for number in range(50):
        client.get(f"/runs/{number}/nothing/{number}")
        client.request(f"X{number}", "/healthz")
        client.get(f"/static/{number}.js")
        client.get(f"/api/v1/runs/{number + 100}")
    middle = len(figures(client))
    for number in range(50, 100):
        client.get(f"/runs/{number}/nothing/{number}")
        client.request(f"X{number}", "/healthz")
        client.get(f"/static/{number}.js")
        client.get(f"/api/v1/runs/{number + 100}")
    assert len(figures(client)) == middle > before


def test_the_store_is_told_as_it_is(client: httpx2.Client, db: Database, mine: Claim, clock: Clock) -> None:
    answered = post_query(db, mine, 1, "preference", 1, CLIPS)
    answer(db, answered, "left", "tab", "human")
    supersede(db, answered, "right", "tab", "human")
    post_query(db, mine, 2, "guidance", 1, CLIPS)
    sign(db, "worker")
    clock.pass_seconds(7)
    found = figures(client)
    assert found["parenting_store_up", ()] == 1
    assert found["parenting_answers_stored", ()] == 2
    assert found["parenting_answers_standing", ()] == 1
    assert found["parenting_runs", ("active",)] == 1
    assert found["parenting_runs", ("failed",)] == 0
    assert found["parenting_questions_open", ("guidance",)] == 1
    assert found["parenting_questions_open", ("preference",)] == 0
    assert found["parenting_question_wait_seconds", ()] == 7
    assert found["parenting_worker_sign_age_seconds", ()] == 7
    set_status(db, mine.run_id, RunStatus.STOPPED)
    assert figures(client)["parenting_questions_open", ("guidance",)] == 0


def test_a_store_that_refuses_is_a_figure_and_counted(
    client: httpx2.Client, db: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse() -> None:
        raise BusyError

    with monkeypatch.context() as patch:
        patch.setattr(db, "read", refuse)
        assert client.get("/api/v1/runs").status_code == 503
        found = figures(client)
    assert found["parenting_store_up", ()] == 0
    assert ("parenting_answers_stored", ()) not in found
    assert found["parenting_refusals_total", ("busy",)] == 1


@pytest.mark.only("sqlite", "it reads SQLite's plan of the query")
def test_a_scrape_reads_no_table_of_queries_or_answers_from_end_to_end(db: Database) -> None:
    with db.read() as session:
        for statement in (_RUNS, _OPEN, _ANSWERS):
            written = statement.compile(db.engine, compile_kwargs={"literal_binds": True})
            plan = [row[3] for row in session.execute(text(f"EXPLAIN QUERY PLAN {written}"))]
            assert [step for step in plan if step.startswith(("SCAN query", "SCAN answer"))] == [], plan


def test_streams_are_counted(client: httpx2.Client, run: Run) -> None:
    app: Any = client._transport.app  # type: ignore[attr-defined]  # the test's client holds the application
    app.state.streams.subscriptions[run.id] = Subscription(streams=3)
    assert figures(client)["parenting_streams_open", ()] == 3


def test_another_host_gets_nothing(client: httpx2.Client) -> None:
    reply = client.get("/metrics", headers={"Host": "evil.example"})
    assert reply.status_code == 400
    assert "parenting_" not in reply.text


def test_a_scrape_takes_few_statements(client: httpx2.Client, db: Database) -> None:
    seen: list[str] = []
    event.listen(db.engine, "before_cursor_execute", lambda *words: seen.append(words[2]))
    client.get("/metrics")
    assert len([one for one in seen if one.startswith("SELECT")]) <= 4
