"""The settings of an empty data folder, which the environment tells as well."""

from __future__ import annotations

from pathlib import Path

import pytest

from parenting.server.settings import Settings


@pytest.fixture
def settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Settings:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PARENTING_DATA", str(tmp_path / "data"))
    monkeypatch.delenv("PARENTING_DATABASE_URL", raising=False)
    return Settings(data=tmp_path / "data", database_url=None)
