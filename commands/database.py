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


@contextmanager
def database() -> Iterator[Database]:
    """Open the database, and close it at the end. Call this within `friendly_errors`.

    Raises:
        ServerError: a setting is wrong; there is no database yet, or it is not up to date.
    """
    chosen = settings()
    url = chosen.url
    if url.startswith("sqlite") and not Path(make_url(url).database or "").is_file():
        raise SetupError(
            f"There is no database at {make_url(url).database}. Set PARENTING_DATA to its folder, "
            "or make one: parenting up."
        )
    db = connect(chosen)
    try:
        require_current(db)
        yield db
    finally:
        db.close()
