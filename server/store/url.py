"""The URL of a database, read in one place: whatever is wrong with it is a sentence of every command."""

from __future__ import annotations

from sqlalchemy import URL, make_url
from sqlalchemy.exc import ArgumentError

from parenting.server.errors import SetupError

DRIVERS = {
    "sqlite": "sqlite",
    "sqlite+pysqlite": "sqlite",
    "postgresql": "postgresql+psycopg",  # by the plain name SQLAlchemy means psycopg2
    "postgres": "postgresql+psycopg",
    "postgresql+psycopg": "postgresql+psycopg",
}
"""Names of drivers that a URL may have, and what each stands for."""
BACKENDS = ("sqlite", "postgresql", "postgres")


class WrongUrlError(ValueError):
    """A URL names no database of ours; the words say why, without its text: that may hold a password."""


def database_url(named: str) -> URL:
    """Return the URL of PARENTING_DATABASE_URL, by the driver that is used.

    Raises:
        SetupError: it cannot be read, or names what is not used here.
    """
    try:
        return parsed(named)
    except WrongUrlError as error:
        raise SetupError(
            f"PARENTING_DATABASE_URL: {error}. Write it as sqlite:////folder/parenting.db "
            "or postgresql://user@host/database."
        ) from None


def parsed(named: str) -> URL:
    """Return a URL by the driver that is used.

    Raises:
        WrongUrlError: it cannot be read, or names another store, driver or option.
    """
    try:
        url = make_url(named)
    except (ArgumentError, ValueError):  # its text would repeat the URL, and so its password
        raise WrongUrlError("this is not a URL") from None
    backend, _, driver = url.drivername.partition("+")
    if backend not in BACKENDS:
        raise WrongUrlError(f"{backend} is neither sqlite nor postgresql")
    if url.drivername not in DRIVERS:
        raise WrongUrlError(f"the driver {driver} is not used here")
    url = url.set(drivername=DRIVERS[url.drivername])
    if backend == "sqlite":
        _require_plain(url)
    else:
        _require_options(url)
    return url


def _require_plain(url: URL) -> None:
    if url.query:
        raise WrongUrlError("a file of SQLite takes no options behind a question mark")


def _require_options(url: URL) -> None:
    """Refuse what libpq would not take: psycopg meets it at each connection, and not as a refusal."""
    if "@" in (url.host or ""):
        raise WrongUrlError("an @ in a password is written %40")
    try:
        from psycopg import ProgrammingError, conninfo
    except ImportError:  # `open_engine` says so
        return
    for name in url.query:
        try:
            conninfo.make_conninfo("", **{name: "1"})
        except ProgrammingError:
            raise WrongUrlError(f"PostgreSQL has no option {name}") from None
    _require_numbers(url)


def _require_numbers(url: URL) -> None:
    try:
        url.get_dialect()().create_connect_args(url)
        int(float(str(url.query.get("connect_timeout", 0))))
    except (ArgumentError, ValueError, OverflowError):
        raise WrongUrlError("its hosts, ports or connect_timeout cannot be read") from None
