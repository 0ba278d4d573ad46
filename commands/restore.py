"""`parenting restore`: put a backup in place of the database."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from parenting.commands.errors import exit_on_interrupt, friendly_errors, settings
from parenting.commands.printing import say
from parenting.server.backups.restoring import restore as put_back


def restore(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A file that `parenting backup` has written.")],
    replace: Annotated[
        bool,
        typer.Option("--replace", help="Replace the database that exists; it is kept in the folder backups."),
    ] = False,
    new_identity: Annotated[
        bool,
        typer.Option(
            "--new-identity",
            help="Give the copy an identity of its own: answers that are meant for the original are refused.",
        ),
    ] = False,
) -> None:
    """Put a backup in place of the database. Web and worker must be stopped.

    The file is read from end to end before anything is changed. A backup of an older version is brought up to
    date by the next start; one of a newer version is refused. Pages that are still open may send answers that
    the backup already holds, which changes nothing, or answers to questions that it does not know, which are
    refused. Sessions, links and tokens of the backup are ended: some may have been revoked after it was made.

    Exit codes: 0 restored; 2 the database is in use or exists, or the file cannot be used; 130 stopped by
    Ctrl-C.

    Example: parenting restore /media/disk/monday.db --replace
    """
    with exit_on_interrupt(), friendly_errors():
        done = put_back(settings(), file, replace, new_identity)
    say(f"{done.database} restored from {file}: {done.holds}.")
    say("Its sessions, links and tokens are ended: `parenting access open` lets you in.")
    if done.aside is not None:
        say(f"The former database is {done.aside}.")
    if done.older and not new_identity:
        say("It is from an older version: the next start, or `parenting migrate`, brings it up to date.")
