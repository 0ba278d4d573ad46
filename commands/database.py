"""The database of the settings, opened by commands that look into it."""

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
    """The database, closed at the end. Call it within `friendly_errors`.

    Raises:
        ServerError: a setting is wrong; there is no database yet, or it is not up to date.
    """
    chosen = settings()
    url = chosen.url
    if url.startswith("sqlite") and not Path(make_url(url).database or "").is_file():
        raise SetupError(
            f"There is no database at {make_url(url).database}. PARENTING_DATA names its folder; "
            "parenting up makes one."
        )
    db = connect(chosen)
    try:
        require_current(db)
        yield db
    finally:
        db.close()
