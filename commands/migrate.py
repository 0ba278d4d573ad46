"""`parenting migrate`: bring the database's tables up to date."""

from __future__ import annotations

import typer

from parenting.commands.errors import friendly_errors, settings
from parenting.server.db import connect
from parenting.server.schema import upgrade


def migrate() -> None:
    """Bring the database's tables up to date, all or nothing. Doing it twice is doing it once.

    Example: PARENTING_DATA=/srv/parenting parenting migrate
    """
    with friendly_errors():
        db = connect(settings())
        try:
            done = upgrade(db)
        finally:
            db.close()
    typer.echo("The database is up to date now." if done else "The database was up to date.")
