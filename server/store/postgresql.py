"""PostgreSQL, by psycopg 3."""

from __future__ import annotations

from typing import Any

from sqlalchemy import URL, Engine, create_engine

from parenting.server.errors import SetupError


def open_engine(url: URL, **options: Any) -> Engine:
    """Open the engine of a PostgreSQL database.

    Raises:
        SetupError: the driver is not installed.
    """
    if url.drivername in ("postgresql", "postgres"):
        url = url.set(drivername="postgresql+psycopg")  # SQLAlchemy means psycopg2 by the plain name
    try:
        return create_engine(url, pool_pre_ping=True, **options)
    except ImportError:
        raise SetupError(
            "PARENTING_DATABASE_URL: the driver of PostgreSQL is missing. "
            "Run: pip install 'parenting[postgres]'"
        ) from None
