"""`parenting runs rename`: give a run another name."""

from __future__ import annotations

from typing import Annotated

import typer

from parenting.commands.database import database
from parenting.commands.errors import UsageError, friendly_errors
from parenting.commands.options import RunNumber
from parenting.commands.printing import say
from parenting.envs.people_text import read_name
from parenting.server.keeping import describe


def command(
    run: RunNumber,
    name: Annotated[str, typer.Argument(help='Its new name; "" takes the name away.')],
) -> None:
    """Give a run another name, over or not. Whoever answers its questions sees it, too.

    Exit codes: 0 renamed; 2 there is no such run, or the name cannot be stored.

    Example: parenting runs rename 3 "Group A, first week"
    """
    with friendly_errors():
        try:
            kept = read_name(name) if name else None
        except ValueError as error:
            raise UsageError(f"NAME: {error}.") from None
        with database() as db:
            describe(db, run, {"name": kept})
    say(f"Run {run} is called {kept}." if kept else f"Run {run} has no name of its own.")
