"""The database of the commands, and the application in this process, which they take for the server."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest
import structlog
from fastapi.testclient import TestClient

from parenting.commands.client import Client
from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.settings import Settings
from tests.database import migrated


@pytest.fixture(autouse=True)
def quiet_log() -> Iterator[None]:
    """The web in this process logs as a served one does, not between the lines that a command prints."""
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger("warning"))
    yield
    structlog.reset_defaults()


@pytest.fixture
def settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Settings:
    """Those that the commands find, too."""
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path / "data"))
    monkeypatch.delenv("PARENTING_DATABASE_URL", raising=False)
    return Settings(data=tmp_path / "data", database_url=None)


@pytest.fixture
def db(settings: Settings) -> Iterator[Database]:
    database = migrated(settings)
    yield database
    database.close()


@pytest.fixture
def web(settings: Settings, db: Database, monkeypatch: pytest.MonkeyPatch) -> Iterator[httpx2.Client]:
    """The application in this process, which the command takes for the server at its URL."""
    with TestClient(create_app(settings, db), base_url="http://localhost") as caller:
        monkeypatch.setattr("parenting.commands.answer.Client", lambda url: Client(url, caller))
        monkeypatch.setattr("parenting.commands.client.Client.close", lambda self: None)
        yield caller
