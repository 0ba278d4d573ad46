"""What the server tells of itself: Plotly's file, the description of the API, readiness."""

import httpx2

from server.db import Database
from server.runs import claim, set_status
from server.tables import Run
from tests.server.conftest import Clock


def test_plotly_is_served_from_its_package(client: httpx2.Client) -> None:
    served = client.get("/static/vendor/plotly.min.js")
    assert served.status_code == 200
    assert served.headers["content-type"].startswith("text/javascript")
    assert "max-age" in served.headers["cache-control"]
    assert b"plotly.js v" in served.content[:200]


def test_api_describes_itself(client: httpx2.Client) -> None:
    described = client.get("/api/v1/openapi.json").json()
    assert {path for path in described["paths"] if path.startswith("/api/v1")} >= {
        "/api/v1/runs",
        "/api/v1/runs/{run_id}/queries/lease",
        "/api/v1/queries/{query_id}/answer",
    }


def test_readiness_tells_of_the_worker(client: httpx2.Client, db: Database, run: Run, clock: Clock) -> None:
    def worker() -> str:
        found: str = client.get("/readyz").json()["worker"]
        return found

    assert worker() == "silent"
    claim(db, "worker-1")
    assert worker() == "alive"
    clock.pass_seconds(6)
    assert worker() == "silent"
    set_status(db, run.id, "stopped")
    assert worker() == "idle"
