"""Migrations: bring a database up to date, or say why it cannot be used.

The scripts are in `migrations/`, in a checkout and in an installed wheel alike.
"""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, inspect

from parenting.server.db import Database
from parenting.server.errors import SetupError

FOLDER = Path(__file__).parents[1] / "migrations"


def upgrade(db: Database) -> bool:
    """Apply the missing migrations, all or none, and return whether there were any.

    Raises:
        SetupError: the database was written by a newer version, or holds other tables than ours.
    """
    with db.write() as session:
        connection = session.connection()
        before = _revision(connection)
        if before == _head():
            return False
        if before is None and inspect(connection).has_table("run"):
            raise SetupError(f"{_place(db)} holds tables of another program. Name another database.")
        config = _config()
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
        return True


def downgrade(db: Database, revision: str) -> None:
    """Take the database back to an older revision, all or nothing, for an older version of Parenting.

    Columns and tables that the older version does not know are dropped with what they hold.

    Args:
        db: A database that is up to date.
        revision: One of the revisions in `migrations/versions`, from "0001" on.

    Raises:
        SetupError: there is no such older revision, or the database is not up to date.
    """
    require_current(db)
    known = [script.revision for script in ScriptDirectory.from_config(_config()).walk_revisions()]
    if revision not in known[1:]:
        raise SetupError(f"'{revision}' is not an older revision. Use one of: {', '.join(known[:0:-1])}.")
    with db.write() as session:
        config = _config()
        config.attributes["connection"] = session.connection()
        command.downgrade(config, revision)


def require_current(db: Database) -> None:
    """Refuse to start on a database that is not up to date.

    Raises:
        SetupError: the database has no tables, older ones or newer ones; the sentence names the remedy.
    """
    with db.read() as session:
        found = _revision(session.connection())
    if found is None:
        raise SetupError(f"{_place(db)} has no tables yet. Run: `parenting migrate`")
    if found != _head():
        raise SetupError(f"{_place(db)} is from an older version of Parenting. Run: `parenting migrate`")


def _revision(connection: Connection) -> str | None:
    found = MigrationContext.configure(connection).get_current_revision()
    known = {script.revision for script in ScriptDirectory.from_config(_config()).walk_revisions()}
    if found is not None and found not in known:
        raise SetupError(
            f"The database is from a newer version of Parenting (revision {found}). "
            "Update Parenting, or name another database."
        )
    return found


def _head() -> str | None:
    return ScriptDirectory.from_config(_config()).get_current_head()


def _config() -> Config:
    config = Config()
    config.set_main_option("script_location", str(FOLDER).replace("%", "%%"))
    return config


def _place(db: Database) -> str:
    return f"The database {db.engine.url.render_as_string()}"
