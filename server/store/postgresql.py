"""PostgreSQL, by psycopg 3: the limits of each connection, kinds of transaction, and what has been committed.

Reads are read-only transactions on one snapshot, as they are on SQLite. Writes see what was committed before
each statement and lock the row of a run before they look at what belongs to it. Every wait has a bound; a
transaction whose process stands still is ended by the server, so that its locks hold up nobody for long.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import URL, Connection, Engine, PoolProxiedConnection, create_engine
from sqlalchemy.orm import Session

from parenting.server.errors import SetupError
from parenting.server.store.postgresql_connections import said, watch
from parenting.server.store.sqlite import BUSY_SECONDS

WRITERS = 16
"""Transactions of one process that may write at once."""
KEPT, MORE = WRITERS + 4, 30
CONNECTIONS = KEPT + MORE + 2
"""Connections that a process takes at most, with the one that sees what is new and the one that is told."""
PRIMARY = "Name the primary server in PARENTING_DATABASE_URL, or promote the standby (pg_promote)."
LIMITS = {
    "lock_timeout": int(BUSY_SECONDS * 1000),
    "statement_timeout": 15_000,
    "idle_in_transaction_session_timeout": 10_000,
}
"""In milliseconds, for each connection; the URL may name others, and a migration lifts them."""
MIGRATION = 1902_06766
"""The number of the advisory lock that one migration at a time holds."""
NETWORK = {
    "connect_timeout": str(int(BUSY_SECONDS)),
    "keepalives_idle": "5",
    "keepalives_interval": "2",
    "keepalives_count": "3",
    "tcp_user_timeout": "10000",
    "application_name": "parenting",
}
"""Parameters of libpq: a server that has gone is noticed within seconds. The URL may name other values."""


def open_engine(url: URL, **options: Any) -> Engine:
    """Open the engine of a PostgreSQL database.

    Raises:
        SetupError: the driver is not installed.
    """
    url = driven(url)
    named = url.normalized_query.get("options", ())
    limits = [f"-c {name}={value}" for name, value in LIMITS.items()]
    network = {name: value for name, value in NETWORK.items() if name not in url.query}
    try:
        engine = create_engine(
            url,
            connect_args={**network, "options": " ".join([*limits, *named])},
            pool_size=KEPT,
            pool_use_lifo=True,  # what one connection has prepared, the others have not
            max_overflow=MORE,
            pool_timeout=BUSY_SECONDS,
            **options,
        )
    except ImportError:
        raise SetupError(
            "PARENTING_DATABASE_URL: the driver of PostgreSQL is missing. "
            "Run: pip install 'parenting[postgres]'"
        ) from None
    own = any("lock_timeout" in name for name in named)
    watch(engine, None if own else BUSY_SECONDS)
    return engine


def driven(url: URL) -> URL:
    """Return a URL that names the driver: by the plain name SQLAlchemy means psycopg2."""
    plain = url.drivername in ("postgresql", "postgres")
    return url.set(drivername="postgresql+psycopg") if plain else url


def reading(engine: Engine) -> Engine:
    """Return the same engine for transactions that only read."""
    return engine.execution_options(reads=True)


def begin_migration(connection: Connection) -> None:
    """Wait until nobody else migrates, and lift the limits of time until this transaction ends.

    Locks of tables keep their limit: who waits for one holds up everybody behind it.
    """
    lift_limits(connection)
    connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({MIGRATION})")
    connection.exec_driver_sql(f"SET LOCAL lock_timeout = {LIMITS['lock_timeout']}")


def is_standby(connection: Connection) -> bool:
    """Return whether a server follows another one, and so takes no writes."""
    follows: bool = connection.exec_driver_sql("SELECT pg_is_in_recovery()").scalar_one()
    return follows


def lift_limits(connection: Connection) -> None:
    """Let the statements and rests of this transaction take what they take."""
    for name in LIMITS:
        connection.exec_driver_sql(f"SET LOCAL {name} = 0")


def watcher(engine: Engine) -> PoolProxiedConnection:
    """Return a connection of its own for `data_version`, which is in no transaction between two calls."""
    connection = engine.raw_connection()
    connection.detach()
    connection.dbapi_connection.autocommit = True  # type: ignore[union-attr]  # psycopg's own attribute
    return connection


def data_version(connection: PoolProxiedConnection) -> str:
    """Return the present snapshot in words: equal ones see the same commits, whoever made them.

    A commit ends a transaction that was in progress or had not begun in every earlier snapshot, so it changes
    them all. The position in the log would not do: it moves before a commit can be seen.

    Raises:
        psycopg.Error: the server said no, or is gone.
    """
    result = said(connection.dbapi_connection, b"SELECT pg_current_snapshot()")
    snapshot: bytes = result.get_value(0, 0)
    return snapshot.decode("ascii")


def snapshot_before(transaction: int) -> str:
    """Return the `data_version` before the transaction of this number, if it is the next and none goes on."""
    return f"{transaction}:{transaction}:"


def transaction_number(session: Session) -> int:
    """Return the number of this transaction, which it is given at the latest now."""
    return int(session.connection().exec_driver_sql("SELECT pg_current_xact_id()::text").scalar_one())


def wait_for_log(session: Session) -> None:
    """Have this transaction's commit wait until the log is on the disk."""
    session.connection().exec_driver_sql("SET LOCAL synchronous_commit = on")
