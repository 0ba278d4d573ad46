"""The PostgreSQL server: whether it is one to write to, keeps what it confirms, and lets enough in."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from sqlalchemy import bindparam, text
from sqlalchemy.orm import Session

from parenting.server.db import Database
from parenting.server.doctor.findings import Finding, error, ok, warning
from parenting.server.store import postgresql
from parenting.server.tables import Table

OLDEST = 15
"""The oldest version that the tests run on."""
ENDANGERED = {
    "fsync": "a crash of the machine can destroy the whole database",
    "full_page_writes": "a crash of the machine can destroy the whole database",
    "synchronous_commit": "a crash of the server loses answers that were confirmed",
}
"""Settings that must not be off, and what it would mean."""
GRANT = (
    "Name the role that owns the tables in PARENTING_DATABASE_URL, or grant this one SELECT, INSERT, UPDATE "
    "and DELETE on them, USAGE on their sequences, and CREATE on the schema before there are any."
)


def server(db: Database) -> Iterator[Finding]:
    """Look at a server's version and part in a replication, at its settings, and at its connections."""
    with db.read() as session:
        connection = session.connection()
        version = connection.dialect.server_version_info or (0,)
        standby = postgresql.is_standby(connection)
        off = [name for name in ENDANGERED if session.scalar(text(f"SHOW {name}")) == "off"]
        lacks = _lacks(session)
        limits = [Limit(*row) for row in session.execute(_LIMITS)]
    shown = ".".join(map(str, version))
    if int(version[0]) < OLDEST:
        yield error("server", f"PostgreSQL {shown} is too old", f"Use version {OLDEST} or newer.")
    elif standby:
        yield error("server", f"PostgreSQL {shown} is a standby, which takes no answers", postgresql.PRIMARY)
    elif lacks:
        yield error("server", f"PostgreSQL {shown}, where this role may not {lacks}", GRANT)
    else:
        yield ok("server", f"PostgreSQL {shown}, which can be written to")
    for name in off:
        yield error("server settings", f"{name} is off: {ENDANGERED[name]}", f"Set {name} = on.")
    if not off:
        yield ok("server settings", f"{', '.join(ENDANGERED)} are on")
    yield _connections(limits)


class Limit(NamedTuple):
    """A limit of connections: its name, their number, those for superusers alone, and those in use."""

    name: str
    most: int
    reserved: int
    used: int

    @property
    def free(self) -> int:
        """Return how many connections may still be made."""
        return self.most - self.reserved - self.used


def _connections(limits: list[Limit]) -> Finding:
    """Compare the limit that is reached first with what a process takes."""
    tight = min(limits, key=lambda limit: limit.free)
    said = (
        f"{tight.used} of {tight.most} ({tight.name}) in use; "
        f"a web or worker process takes {postgresql.CONNECTIONS} at most"
    )
    if tight.free < postgresql.CONNECTIONS:
        return warning("connections", said, f"Raise {tight.name}, or end what holds them.")
    room = min(limit.most - limit.reserved for limit in limits) // postgresql.CONNECTIONS
    return ok("connections", f"{said}; there is room for {room} of them")


def _lacks(session: Session) -> str | None:
    """Return what the role would have to be allowed to do, as pages and workers write every table."""
    there, closed = [session.scalars(query, _NAMES).all() for query in (_TABLES, _CLOSED)]
    if not there:
        return None if session.scalar(_MAY_CREATE) else "make tables"
    more = f" and {len(closed) - 3} more" if len(closed) > 3 else ""
    return f"write to {', '.join(closed[:3])}{more}" if closed else None


_NAMES = {
    "tables": list(Table.metadata.tables),
    "counters": [f"{one}_id_seq" for one in Table.metadata.tables],
}
_TABLES = text(
    "SELECT relname FROM pg_class WHERE relname IN :tables AND relkind = 'r' AND pg_table_is_visible(oid)"
).bindparams(bindparam("tables", expanding=True))
_CLOSED = text(
    "SELECT relname FROM pg_class WHERE pg_table_is_visible(oid) AND CASE "
    "WHEN relkind = 'r' AND relname IN :tables THEN NOT (has_table_privilege(oid, 'SELECT') "
    "AND has_table_privilege(oid, 'INSERT') AND has_table_privilege(oid, 'UPDATE') "
    "AND has_table_privilege(oid, 'DELETE')) "
    "WHEN relkind = 'S' AND relname IN :counters THEN NOT has_sequence_privilege(oid, 'USAGE') "
    "ELSE false END ORDER BY relname"
).bindparams(bindparam("tables", expanding=True), bindparam("counters", expanding=True))
_MAY_CREATE = text("SELECT coalesce(has_schema_privilege(current_schema(), 'CREATE'), false)")
# A role sees whose connections there are, but not the kind of those of others.
_LIMITS = text(
    "WITH client AS (SELECT datname, usename FROM pg_stat_activity "
    "WHERE usename IS NOT NULL AND coalesce(backend_type, 'client backend') = 'client backend') "
    "SELECT 'max_connections', CAST(current_setting('max_connections') AS integer), "
    "CAST(current_setting('superuser_reserved_connections') AS integer), (SELECT count(*) FROM client) "
    "UNION ALL SELECT 'the CONNECTION LIMIT of the role', rolconnlimit, 0, "
    "(SELECT count(*) FROM client WHERE usename = session_user) "
    "FROM pg_roles WHERE rolname = session_user AND rolconnlimit >= 0 AND NOT rolsuper "
    "UNION ALL SELECT 'the CONNECTION LIMIT of the database', datconnlimit, 0, "
    "(SELECT count(*) FROM client WHERE datname = current_database()) "
    "FROM pg_database JOIN pg_roles ON rolname = session_user "
    "WHERE datname = current_database() AND datconnlimit >= 0 AND NOT rolsuper"
)
