"""Print for a terminal: no stored text and no argument can steer it."""

from __future__ import annotations

import typer

from parenting.envs.people_text import isolated, printable


def say(text: str, err: bool = False, nl: bool = True) -> None:
    """Print a text of one or more lines; control characters in it become escapes such as \\x1b.

    Args:
        text: The text; JSON passes unchanged, since it is ASCII.
        err: Print on standard error.
        nl: End with a line end.
    """
    typer.echo(printable(text), err=err, nl=nl)


def cell(text: str) -> str:
    """Return a text for one cell of a table: on one line, and its direction stays within the cell."""
    return printable(isolated(text), breaks=False)
