"""The memory of the web process: requests of every kind leave no objects behind."""

from __future__ import annotations

import gc
from collections import Counter

import httpx2
import pytest
from sqlalchemy import event

from parenting.server.db import Database
from parenting.server.tables import Run

WARM, ROUNDS, TIMES = 4, 3, 3
"""Libraries fill caches in their first calls, a thread may start later; a leak grows each time."""
PATHS = (
    "/",
    "/runs/{name}",
    "/runs/{id}/parent",
    "/runs/{id}/stages",
    "/runs/{name}/history",
    "/api/v1/runs",
    "/api/v1/runs/{id}",
    "/api/v1/runs/{id}/queries?limit=20",
    "/api/v1/runs/{id}/metrics?limit=50",
    "/static/parent.js",
    "/healthz",
    "/readyz",
    "/metrics",
    "/api/v1/runs/999",
    "/nothing/here",
    "/api/v1/runs/one",
)


def ask(client: httpx2.Client, run: Run) -> None:
    """Send one request of each kind, and one for a lease, of which there is none."""
    for path in PATHS:
        client.get(path.format(id=run.id, name=run.public_id), follow_redirects=False)
    client.post(f"/api/v1/runs/{run.id}/queries/lease", json={"client_id": "someone"})


def living() -> Counter[str]:
    """The number of objects of each type that the garbage collector leaves."""
    gc.collect()
    numbers: Counter[str] = Counter()
    for kind, number in Counter(map(type, gc.get_objects())).items():
        numbers[f"{kind.__module__}.{kind.__qualname__}"] += number
    return numbers


def grown(client: httpx2.Client, run: Run) -> set[str]:
    """The types of which each round of requests leaves an object, or more."""
    before = living()
    for _ in range(ROUNDS):
        ask(client, run)
    return {name for name, number in (living() - before).items() if number >= ROUNDS}


def forget_statements(db: Database) -> None:
    """Have psycopg count none: it keeps a hundred for each connection, which fill slowly."""
    if db.engine.dialect.name == "postgresql":
        event.listen(db.engine, "connect", lambda driver, _record: setattr(driver, "prepare_threshold", None))
        db.engine.dispose()


@pytest.mark.slow
def test_requests_leave_no_objects_behind(client: httpx2.Client, db: Database, run: Run) -> None:
    forget_statements(db)
    for _ in range(WARM):
        ask(client, run)
    gc.freeze()  # those of other tests are not counted: in a process that ran thousands it would take seconds
    living()  # the first count leaves a few objects itself
    assert set.intersection(*(grown(client, run) for _ in range(TIMES))) == set()
