"""`parenting migrate`: bring the database's tables up to date, or back to an older version's."""

from __future__ import annotations

from typing import Annotated

import typer

from parenting.commands.errors import friendly_errors, settings
from parenting.commands.printing import say
from parenting.server.backups.before_migrating import migrate as migrate_tables
from parenting.server.db import connect


def migrate(
    to: Annotated[
        str | None,
        typer.Option(
            metavar="REVISION",
            help="Go back to this revision, for an older version of Parenting; what only later versions "
            "know is dropped.",
            show_default="the newest",
        ),
    ] = None,
    backup: Annotated[
        bool,
        typer.Option("--backup/--no-backup", help="Copy the database first, if anything is to be changed."),
    ] = True,
) -> None:
    """Bring the database's tables up to date. All changes are made or none; a second call changes nothing.

    Before it changes tables it copies the database into the folder backups beside it, where the last three
    copies of this kind are kept.

    Exit codes: 0; 2 the database cannot be used, is of a newer version, or there is no room for the copy.

    Example: PARENTING_DATA=/srv/parenting parenting migrate
    """
    with friendly_errors():
        chosen = settings()
        db = connect(chosen)
        try:
            changed = migrate_tables(db, chosen.data, to, backup)
        finally:
            db.close()
    if to is not None:
        say(f"The database is at revision {to} now.")
    else:
        say("The database is up to date now." if changed else "The database was up to date.")
