"""`parenting migrate`: bring the database's tables up to date, or back to an older version's."""

from __future__ import annotations

from typing import Annotated

import typer

from parenting.commands.errors import friendly_errors, settings
from parenting.server.db import connect
from parenting.server.migrate import downgrade, upgrade


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
) -> None:
    """Bring the database's tables up to date. All changes are made or none; a second call changes nothing.

    Exit codes: 0; 2 the database cannot be used.

    Example: PARENTING_DATA=/srv/parenting parenting migrate
    """
    with friendly_errors():
        db = connect(settings())
        try:
            if to is not None:
                downgrade(db, to)
            changed = to is None and upgrade(db)
        finally:
            db.close()
    if to is not None:
        typer.echo(f"The database is at revision {to} now.")
    else:
        typer.echo("The database is up to date now." if changed else "The database was up to date.")
