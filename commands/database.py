"""The database of the settings, for commands that read it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import structlog

from parenting.commands.errors import settings
from parenting.server.db import Database, connect
from parenting.server.errors import SetupError
from parenting.server.migrate import require_current
from parenting.server.settings import Settings
from parenting.server.store import high_water
from parenting.server.store.url import database_url

log = structlog.get_logger()


@contextmanager
def database() -> Iterator[Database]:
    """Open the database for reading, and close it at the end. Call this within `friendly_errors`.

    Raises:
        ServerError: a setting is wrong; there is no database yet, or it is not up to date.
    """
    chosen = settings()
    require_file(chosen)
    db = connect(chosen, reading=True)
    try:
        require_current(db)
        yield db
    finally:
        db.close()


def tell_mark(chosen: Settings) -> None:
    """Say at the start of a process that this user cannot write the mark of a SQLite database."""
    if chosen.url.startswith("sqlite"):
        said = high_water.lagging(Path(database_url(chosen.url).database or ""))
        if said is not None:
            log.warning(said)


def require_file(chosen: Settings) -> None:
    """Refuse to make an SQLite file where there is none: only `up` and `migrate` do.

    Raises:
        SetupError: there is none, and none was there. One that is missing is told by `connect`.
    """
    if not chosen.url.startswith("sqlite"):
        return
    database = Path(database_url(chosen.url).database or "")
    if not database.exists() and high_water.read(database) is None:
        raise SetupError(
            f"There is no database at {database}. Set PARENTING_DATA to its folder, "
            "or make one: parenting migrate, or parenting up with its pages."
        )
