"""`parenting backup`: write a checked copy of the database while everything goes on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from parenting.commands.errors import exit_on_interrupt, friendly_errors, settings
from parenting.commands.printing import say
from parenting.server.backups.making import back_up


def backup(
    to: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Write to this file.", show_default="a new one in the folder backups"
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
) -> None:
    """Write a backup of the database. Web and worker may go on meanwhile.

    The backup is the database of one moment, with every answer that was stored before. It is read from end to
    end before it gets its name, and only its owner can read it. Of a PostgreSQL database pg_dump writes it.

    Exit codes: 0 written; 2 the database cannot be used, or the file exists or cannot be written; 130
    stopped by Ctrl-C.

    Example: parenting backup --to /media/disk/monday.db
    """
    with exit_on_interrupt(), friendly_errors():
        made = back_up(settings(), to, force)
    say(f"Backup written to {made.file}: {made.holds}.")
