"""`parenting person list`: list the people who answered, as `parenting person` does."""

from __future__ import annotations

from typing import Annotated

import typer

from parenting.commands.person import person


def command(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """List the people who answered: pseudonym, name if one was given, answers and runs of each.

    Exit codes: 0 listed; 2 the database does not exist or is not up to date.

    Example: parenting person list
    """
    person(as_json)
