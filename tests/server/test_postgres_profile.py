"""The services of docker-compose.yml on PostgreSQL with a Unix socket, as the profile `postgres` has them."""

from __future__ import annotations

from pathlib import Path

import pytest
from sqlalchemy import make_url

from parenting.server.settings import Settings
from tests.database import unmigrated
from tests.services import Stack


@pytest.mark.slow
@pytest.mark.only("postgresql", "SQLite is in tests/test_services.py")
def test_the_services_do_their_work_on_postgresql(settings: Settings, tmp_path: Path) -> None:
    """It starts three programs, two of which load torch."""
    unmigrated(settings).close()  # the database is there, and empty
    url = make_url(settings.database_url or "")
    folder = url.query["host"]
    profile = f"{url.drivername}://{url.username}@/{url.database}?host={folder}"
    stack = Stack(tmp_path, PARENTING_DATABASE_URL=profile, PARENTING_PORT="0")
    with stack.service("migrate") as migrate:
        assert migrate.wait(60) == 0
    with stack.service("worker"):
        stack.until_healthy("worker")
    assert list(tmp_path.glob("*.db")) == [], "they were on SQLite"
