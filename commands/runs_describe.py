"""`parenting runs describe`: keep a description with a run."""

from __future__ import annotations

from typing import Annotated

import typer

from parenting.commands.database import database
from parenting.commands.errors import UsageError, friendly_errors
from parenting.commands.options import RunNumber
from parenting.commands.printing import say
from parenting.server.keeping import LONGEST_DESCRIPTION, describe, read_description


def command(
    run: RunNumber,
    text: Annotated[str, typer.Argument(help='The description; "" takes it away.')],
) -> None:
    """Keep a description with a run, over or not.

    Exit codes: 0 kept; 2 there is no such run, or the text cannot be stored.

    Example: parenting runs describe 3 "The parent was told to be strict."
    """
    with friendly_errors():
        try:
            kept = read_description(text)
        except ValueError as error:
            raise UsageError(f"TEXT: {error}.") from None
        if len(kept) > LONGEST_DESCRIPTION:
            raise UsageError(
                f"TEXT: at most {LONGEST_DESCRIPTION} characters are kept; this has {len(kept)}."
            )
        with database() as db:
            describe(db, run, {"description": kept})
    say(f"The description of run {run} is {'kept' if kept else 'taken away'}.")
