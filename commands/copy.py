"""`parenting copy`: copy a database into an empty one of another store."""

from __future__ import annotations

from typing import Annotated

import typer

from parenting.commands.errors import exit_on_interrupt, friendly_errors, settings
from parenting.commands.printing import say
from parenting.commands.progress import bar
from parenting.server.transfer.copying import copy as copied

PLACE = "the path of an SQLite file, or postgresql://user@host/database."


def copy(
    source: Annotated[str, typer.Argument(metavar="SOURCE", help=f"The database to copy: {PLACE}")],
    target: Annotated[str, typer.Argument(metavar="TARGET", help=f"An empty database: {PLACE}")],
    snapshot: Annotated[
        bool,
        typer.Option("--snapshot", help="Copy one moment of a source that is in use; later answers stay."),
    ] = False,
) -> None:
    """Move a database from SQLite to PostgreSQL, or back. Web and worker must be stopped.

    Every row is copied with its number and public id, then read again and compared by its hash. The target is
    complete or as it was before, also after Ctrl-C or a crash, so the command may be given again. The source
    is not changed: name the target in PARENTING_DATABASE_URL, and keep the source as a backup. A
    password in an argument is seen by others on the machine: put it into PGPASSWORD or ~/.pgpass.

    Exit codes: 0 copied; 2 the source is in use, of another version or damaged, or the target is not empty;
    130 stopped by Ctrl-C.

    Example: parenting copy ~/.local/state/parenting/parenting.db postgresql://me@localhost/parenting
    """
    with exit_on_interrupt(), friendly_errors():
        chosen = settings()
        with bar("rows") as show:
            done = copied(source, target, chosen.data, snapshot, show)
    say(f"Copied to {done.target}: {done}.")
    say("Set PARENTING_DATABASE_URL to it; the source is as it was.")
