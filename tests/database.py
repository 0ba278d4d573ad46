"""Databases for the tests, on SQLite and on PostgreSQL: copies of one that was migrated once a process."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime
from functools import cache
from pathlib import Path

from sqlalchemy import make_url

from parenting.server.db import Database, connect, utc_now
from parenting.server.migrate import upgrade
from parenting.server.settings import Settings
from tests.access import seed
from tests.postgres import cluster

STORES = ("sqlite", "postgresql")


@contextmanager
def database_url(store: str) -> Iterator[str | None]:
    """The setting `database_url` of a database that does not exist yet; it is dropped at the end."""
    if store == "sqlite":
        yield None
        return
    name = cluster().new_name()
    yield cluster().url(name)
    cluster().drop(name)


def unmigrated(settings: Settings, clock: Callable[[], datetime] = utc_now) -> Database:
    """A new database without tables: the one that `settings` name."""
    if settings.database_url is not None:
        cluster().create(_name(settings.database_url))
    seed(settings.data)
    return _connect(settings, clock)


def migrated(settings: Settings, clock: Callable[[], datetime] = utc_now) -> Database:
    """A new database with all tables and no rows: the one that `settings` name."""
    if settings.database_url is not None:
        cluster().copy(_name(settings.database_url), _postgresql_template())
        seed(settings.data)
        return _connect(settings, clock)
    database = _connect(settings, clock)
    seed(settings.data)
    file = settings.data / "parenting.db"
    assert not file.exists(), "there is a database already"
    file.touch(0o600)
    file.write_bytes(_sqlite_template())
    return database


def _connect(settings: Settings, clock: Callable[[], datetime]) -> Database:
    """Connect; the clock of a test moves leases and claims, too."""
    return connect(settings, clock, getattr(clock, "mark", None))


def _name(url: str) -> str:
    return str(make_url(url).database)


@cache
def _sqlite_template() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        database = connect(Settings(data=Path(folder), database_url=None))
        upgrade(database)
        database.close()  # what the log holds goes into the file
        return (Path(folder) / "parenting.db").read_bytes()


@cache
def _postgresql_template() -> str:
    name = cluster().new_name()
    with tempfile.TemporaryDirectory() as folder:
        database = unmigrated(Settings(data=Path(folder), database_url=cluster().url(name)))
        upgrade(database)
        database.close()
    return name
