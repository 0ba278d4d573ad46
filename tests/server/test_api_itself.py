"""The server's account of itself: the description of the API, readiness."""

import httpx2
from sqlalchemy import text

from parenting.server.db import Database
from parenting.server.workers import SILENT_SECONDS, sign, sign_off
from tests.server.conftest import Clock


def test_api_describes_itself(client: httpx2.Client) -> None:
    described = client.get("/api/v1/openapi.json").json()
    assert {path for path in described["paths"] if path.startswith("/api/v1")} >= {
        "/api/v1/runs",
        "/api/v1/runs/{run_id}/queries/lease",
        "/api/v1/queries/{query_id}/answer",
    }


def test_readiness_needs_a_worker(client: httpx2.Client, db: Database, clock: Clock) -> None:
    def said() -> str:
        reply = client.get("/readyz")
        assert (reply.status_code == 503) == ("error" in reply.json())
        said: str = reply.json()["error"]["message"] if reply.status_code == 503 else reply.json()["worker"]
        return said

    assert said() == "No worker gives a sign of life. Start one: `parenting worker`"
    sign(db, "worker-1")
    assert said() == "ok"
    clock.pass_seconds(SILENT_SECONDS + 1)
    assert said().startswith("No worker")
    sign(db, "worker-1")
    sign_off(db, "worker-1")
    assert said().startswith("No worker")


def test_readiness_needs_the_tables_of_this_version(client: httpx2.Client, db: Database) -> None:
    sign(db, "worker-1")
    with db.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '0001'"))
    reply = client.get("/readyz")
    assert reply.status_code == 503
    assert "older version" in reply.json()["error"]["message"]
    assert client.get("/healthz").status_code == 200
