"""Migrations: bring a database up to date, or say why it cannot be used.

The scripts are in `migrations/`, in a checkout and in an installed wheel alike. Alembic is loaded by what
migrates alone: web and worker compare one revision at their start, and Alembic takes a third of a second.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Literal

from sqlalchemy import Column, Connection, MetaData, String, Table, inspect, select
from sqlalchemy.orm import Session

from parenting.server.db import Database
from parenting.server.errors import SetupError
from parenting.server.store.postgresql import PRIMARY, begin_migration, is_standby

FOLDER = Path(__file__).parents[1] / "migrations"

VERSIONS = Table("alembic_version", MetaData(), Column("version_num", String(32)))
"""Alembic's own table. Its `MigrationContext` would define it, and compile its query, again for each look."""

Keep = Callable[[str], Path]
"""A function that copies a database of a revision before it is migrated."""


def upgrade(db: Database, keep: Keep | None = None) -> bool:
    """Apply the missing migrations, all or none, and return whether there were any.

    Args:
        db: The database.
        keep: Copies the database before its first change, where it has tables; none makes no copy.

    Raises:
        SetupError: the database was written by a newer version, holds other tables than ours, or cannot be
            copied first.
    """
    with db.write() as session:
        connection = _begin(session)
        before = revision_in(connection)
        if before == newest():
            return False
        if before is None and inspect(connection).has_table("run"):
            raise SetupError(f"{_place(db)} holds tables of another program. Name another database.")
        if keep is not None and before is not None:
            keep(before)
        _alembic(connection, "upgrade", "head")
        return True


def create_tables(connection: Connection) -> None:
    """Make the tables of this version where there are none, in a transaction that is open."""
    _alembic(connection, "upgrade", "head")


def downgrade(db: Database, to: str, keep: Keep | None = None) -> None:
    """Take the database back to an older revision, all or nothing, for an older version of Parenting.

    Columns and tables that the older version does not know are dropped with what they hold.

    Args:
        db: A database that is up to date.
        to: One of the revisions in `migrations/versions`, from "0001" on.
        keep: Copies the database first; none makes no copy.

    Raises:
        SetupError: there is no such older revision, or the database is not up to date.
    """
    require_current(db)
    known = known_revisions()
    if to not in known[1:]:
        raise SetupError(f"'{to}' is not an older revision. Use one of: {', '.join(known[:0:-1])}.")
    with db.write() as session:
        connection = _begin(session)
        if keep is not None:
            keep(newest())
        _alembic(connection, "downgrade", to)


def require_current(db: Database) -> None:
    """Refuse to start on a database that is not up to date.

    Raises:
        SetupError: the database has no tables, older ones or newer ones; the sentence names the remedy.
    """
    found = revision(db)
    if found is None:
        raise SetupError(f"{_place(db)} has no tables yet. Run: `parenting migrate`")
    if found != newest():
        raise SetupError(f"{_place(db)} is from an older version of Parenting. Run: `parenting migrate`")


def require_ready(db: Database) -> None:
    """Refuse to serve pages from, or to raise runs in, a database that is not up to date or takes no writes.

    Raises:
        SetupError: the database is a standby of PostgreSQL, or `require_current` refuses it.
    """
    require_primary(db)
    require_current(db)


def require_primary(db: Database) -> None:
    """Refuse a server of PostgreSQL that follows another one, and so takes no writes.

    Raises:
        SetupError: it does; the sentence names the remedy.
    """
    if db.engine.dialect.name != "postgresql":
        return
    with db.read() as session:
        standby = is_standby(session.connection())
    if standby:
        raise SetupError(f"{_place(db)} is a standby, which takes no answers. {PRIMARY}")


def revision(db: Database) -> str | None:
    """Return the revision of a database's tables; None if it has none.

    Raises:
        SetupError: a newer version wrote them.
    """
    with db.read() as session:
        return revision_in(session.connection())


def newest() -> str:
    """Return the revision of this version's tables."""
    return known_revisions()[0]


@cache
def known_revisions() -> tuple[str, ...]:
    """Return all revisions, the newest first. They are read once: a health check asks every few seconds."""
    texts = (path.read_text("utf-8") for path in (FOLDER / "versions").glob("*.py"))
    after = {before or None: revision for text in texts for revision, before in [_named(text)]}
    known: list[str] = []
    while (following := after.get(known[0] if known else None)) is not None:
        known.insert(0, following)
    return tuple(known)


def _named(script: str) -> tuple[str, str]:
    """Return a script's revision and the one before it, "" for none."""
    revision, before = (
        re.search(rf'^{name} = (?:"(\w+)"|None)$', script, re.MULTILINE)
        for name in ("revision", "down_revision")
    )
    if revision is None or before is None:
        raise ValueError(f"A migration does not name its revision: {script[:80]}")
    return revision[1], before[1] or ""


def _begin(session: Session) -> Connection:
    """Return the connection of a migration, once no other is under way."""
    connection = session.connection()
    if connection.dialect.name == "postgresql":
        begin_migration(connection)
    return connection


def revision_in(connection: Connection) -> str | None:
    """Return the revision of the tables that a connection sees; None if there are none.

    Raises:
        SetupError: a newer version wrote them.
    """
    if not inspect(connection).has_table(VERSIONS.name):
        return None
    found = connection.scalars(select(VERSIONS.c.version_num)).one_or_none()
    if found is not None and found not in known_revisions():
        raise SetupError(
            f"The database is from a newer version of Parenting (revision {found}). "
            "Update Parenting, or name another database."
        )
    return found


def _alembic(connection: Connection, verb: Literal["upgrade", "downgrade"], to: str) -> None:
    from alembic import command
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(FOLDER).replace("%", "%%"))
    config.attributes["connection"] = connection
    getattr(command, verb)(config, to)


def _place(db: Database) -> str:
    return f"The database {db.engine.url.render_as_string()}"
