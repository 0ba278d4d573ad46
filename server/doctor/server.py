"""The PostgreSQL server: whether it is one to write to, keeps what it confirms, and lets enough in."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import text

from parenting.server.db import Database
from parenting.server.doctor.findings import Finding, error, ok, warning
from parenting.server.store import postgresql

OLDEST = 15
"""The oldest version that the tests run on."""
ENDANGERED = {
    "fsync": "a crash of the machine can destroy the whole database",
    "full_page_writes": "a crash of the machine can destroy the whole database",
    "synchronous_commit": "a crash of the server loses answers that were confirmed",
}
"""Settings that must not be off, and what it would mean."""


def server(db: Database) -> Iterator[Finding]:
    """Look at a server's version and part in a replication, at its settings, and at its connections."""
    with db.read() as session:
        connection = session.connection()
        version = connection.dialect.server_version_info or (0,)
        standby = postgresql.is_standby(connection)
        off = [name for name in ENDANGERED if session.scalar(text(f"SHOW {name}")) == "off"]
        most, reserved, used = session.execute(_CONNECTIONS).one()
    shown = ".".join(map(str, version))
    if int(version[0]) < OLDEST:
        yield error("server", f"PostgreSQL {shown} is too old", f"Use version {OLDEST} or newer.")
    elif standby:
        yield error("server", f"PostgreSQL {shown} is a standby, which takes no answers", postgresql.PRIMARY)
    else:
        yield ok("server", f"PostgreSQL {shown}, which can be written to")
    for name in off:
        yield error("server settings", f"{name} is off: {ENDANGERED[name]}", f"Set {name} = on.")
    if not off:
        yield ok("server settings", f"{', '.join(ENDANGERED)} are on")
    said = f"{used} of {most} in use; a web or worker process takes {postgresql.CONNECTIONS} at most"
    if most - reserved - used < postgresql.CONNECTIONS:
        yield warning("connections", said, "Raise max_connections, or end what holds them.")
    else:
        yield ok("connections", f"{said}; there is room for {_room(most, reserved)} of them")


def _room(most: int, reserved: int) -> int:
    return int((most - reserved) // postgresql.CONNECTIONS)


_CONNECTIONS = text(
    "SELECT CAST(current_setting('max_connections') AS integer), "
    "CAST(current_setting('superuser_reserved_connections') AS integer), "
    "(SELECT count(*) FROM pg_stat_activity WHERE backend_type = 'client backend')"
)
