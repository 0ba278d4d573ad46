"""`parenting runs archive`: leave a run out of the list, or take it in again."""

from __future__ import annotations

from typing import Annotated

import typer

from parenting.commands.database import database
from parenting.commands.errors import friendly_errors
from parenting.commands.options import AnyRunNumber
from parenting.commands.printing import say
from parenting.server.keeping import archive


def command(
    run: AnyRunNumber,
    undo: Annotated[bool, typer.Option("--undo", help="Take it out of the archive.")] = False,
) -> None:
    """Leave a run out of the list, or take it in again. Nothing of it is lost, and its agent learns the same.

    Exit codes: 0 done; 2 there is no such run.

    Example: parenting runs archive 3
    """
    with friendly_errors(), database() as db:
        archive(db, run, not undo)
    say(f"Run {run} is {'in the list again' if undo else 'archived; `parenting runs --all` lists it'}.")
