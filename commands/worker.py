"""`parenting worker`: raise the agents of the database's runs."""

from __future__ import annotations

import typer

from commands.lifeline import follow
from commands.said import plainly, settings


def worker() -> None:
    """Raise the agents of the database's runs until Ctrl-C; goes on exactly where an earlier worker was.

    Example: parenting worker
    """
    follow()
    from server.worker import main  # loads torch

    with plainly():
        code = main(settings())
    raise typer.Exit(code)
