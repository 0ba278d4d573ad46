"""Databases for the tests: copies of one that was migrated once a process."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from datetime import datetime
from functools import cache
from pathlib import Path

from parenting.server.db import Database, connect, utc_now
from parenting.server.migrate import upgrade
from parenting.server.settings import Settings


def migrated(settings: Settings, clock: Callable[[], datetime] = utc_now) -> Database:
    """A new database with all tables and no rows, in the data folder of `settings`."""
    database = connect(settings, clock)
    file = settings.data / "parenting.db"
    assert not file.exists(), "there is a database already"
    file.touch(0o600)
    file.write_bytes(_template())
    return database


@cache
def _template() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        database = connect(Settings(data=Path(folder), database_url=None))
        upgrade(database)
        database.close()  # what the log holds goes into the file
        (file,) = Path(folder).iterdir()
        return file.read_bytes()
