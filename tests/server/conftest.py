"""A migrated database with a clock that the test moves, a run in it, and an HTTP client."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx2
import pytest
from fastapi.testclient import TestClient

from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim, claim
from parenting.server.settings import Settings
from parenting.server.store.clock import Mark
from parenting.server.tables import Run
from tests.database import STORES, database_url, migrated

HERE = Path(__file__).parent
CLIP = {
    "actions": ["up"],
    "length": 1,
    "frames": [
        {"ground": ["WWW", "W G", "WWW"], "observed": ["WWW", "WAG", "WWW"], "agent": [1, 1], "box": None},
        {"ground": ["WWW", "W G", "WWW"], "observed": ["WWW", "W A", "WWW"], "agent": [1, 2], "box": None},
    ],
}
CLIPS: dict[str, Any] = {"left": CLIP, "right": {**CLIP, "actions": ["down"]}}


class Clock:
    """Stands still until it is moved."""

    def __init__(self) -> None:
        self.now = datetime(2026, 11, 22, 12, tzinfo=UTC)

    def __call__(self) -> datetime:
        return self.now

    def mark(self, _session: object) -> Mark:
        """The clock of leases and claims, which moves with the wall clock here."""
        return Mark("the clock of the test", self.now.timestamp())

    def pass_seconds(self, seconds: float) -> None:
        self.now += timedelta(seconds=seconds)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run what uses a database on both stores, unless it is about one or says itself which."""
    chosen = any("store" in mark.args[0] for mark in metafunc.definition.iter_markers("parametrize"))
    if "store" in metafunc.fixturenames and not chosen:
        only = metafunc.definition.get_closest_marker("only")
        metafunc.parametrize("store", only.args[:1] if only else STORES, indirect=True)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is done again on PostgreSQL: `make faults` does it. Tests of the store itself stay here."""
    for item in items:
        callspec = getattr(item, "callspec", None)
        if callspec is None or not item.path.is_relative_to(HERE) or item.path.is_relative_to(HERE / "store"):
            continue
        if callspec.params.get("store") == "postgresql" and item.get_closest_marker("only") is None:
            item.add_marker("postgresql")


@pytest.fixture
def store(request: pytest.FixtureRequest) -> str:
    """The kind of database: sqlite or postgresql."""
    kind: str = request.param
    return kind


@pytest.fixture
def settings(tmp_path: Path, store: str) -> Iterator[Settings]:
    with database_url(store) as url:
        yield Settings(data=tmp_path, database_url=url)


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def db(settings: Settings, clock: Clock) -> Iterator[Database]:
    database = migrated(settings, clock)
    yield database
    database.close()


@pytest.fixture
def run(db: Database) -> Run:
    """It has two stages, so that it can be told to mature."""
    return start(db, NewRun(world="unsafe-exploration", config={"stages": 2}))


@pytest.fixture
def mine(db: Database, run: Run) -> Claim:
    """The worker's claim on the run."""
    (only,) = claim(db, "worker-1")
    return only


@pytest.fixture
def guidance(db: Database, mine: Claim) -> int:
    """An open guidance query, asked at tick 5."""
    return post_query(db, mine, 5, "guidance", 1, CLIPS)


@pytest.fixture
def client(settings: Settings, db: Database) -> Iterator[httpx2.Client]:
    """As a program of this machine calls: no Origin, no Sec-Fetch-Site."""
    with TestClient(create_app(settings, db), base_url="http://localhost") as caller:
        yield caller
