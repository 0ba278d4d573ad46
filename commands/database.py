"""The database of the settings, for commands that read it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import make_url

from parenting.commands.errors import settings
from parenting.server.db import Database, connect
from parenting.server.errors import SetupError
from parenting.server.migrate import require_current
from parenting.server.store import high_water


@contextmanager
def database() -> Iterator[Database]:
    """Open the database for reading, and close it at the end. Call this within `friendly_errors`.

    Raises:
        ServerError: a setting is wrong; there is no database yet, or it is not up to date.
    """
    chosen = settings()
    if chosen.url.startswith("sqlite"):
        _require_file(Path(make_url(chosen.url).database or ""))
    db = connect(chosen, reading=True)
    try:
        require_current(db)
        yield db
    finally:
        db.close()


def _require_file(database: Path) -> None:
    """Refuse to make a database where there is none; one that is missing is told by `connect`."""
    if not database.exists() and high_water.read(database) is None:
        raise SetupError(
            f"There is no database at {database}. Set PARENTING_DATA to its folder, "
            "or make one: parenting up."
        )
