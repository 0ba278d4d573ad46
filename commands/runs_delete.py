"""`parenting runs delete`: delete a run for good, after it was asked."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from parenting._plural import counted
from parenting.commands.database import database
from parenting.commands.errors import UsageError, exit_on_interrupt, friendly_errors
from parenting.commands.options import AnyRunNumber
from parenting.commands.printing import say
from parenting.server import deletion
from parenting.server.db import Database
from parenting.server.sizes import size_text


def command(
    run: AnyRunNumber,
    yes: Annotated[bool, typer.Option("--yes", help="Ask nothing; for scripts.")] = False,
) -> None:
    """Say what a run holds, ask, and delete it for good: answers, questions, checkpoints, metrics, log.

    A worker that raises it leaves it, and an answer that somebody gives now is refused. Web and worker go on
    meanwhile. After Ctrl-C the run is gone for everybody, and the same command or a worker deletes the rest.
    Backups keep the run. What it held, in numbers, stays: `parenting runs deleted`.

    Exit codes: 0 deleted; 1 not deleted, as was answered; 2 there is no such run, or nobody can be asked and
    --yes is missing; 130 stopped by Ctrl-C.

    Example: parenting runs delete 3
    """
    with exit_on_interrupt(), friendly_errors(), database() as db:
        if run not in deletion.under_way(db) and not _confirmed(db, run, yes):
            say(f"Run {run} is not deleted.")
            raise typer.Exit(1)
        stone = deletion.delete_run(db, run)
    say(f"Run {run} is deleted: {size_text(stone.held['bytes'])}.")


def _confirmed(db: Database, run: int, yes: bool) -> bool:
    """Say what a run holds, and return whether it may go.

    Raises:
        UsageError: nobody can be asked.
    """
    held = deletion.holds(db, run)
    what = [counted(held.answers, "answer"), counted(held.questions, "question")]
    what += [
        counted(held.checkpoints, "checkpoint"),
        counted(held.metrics, "row"),
        counted(held.events, "event"),
    ]
    say(f"Run {run} holds {', '.join(what)}: {size_text(held.bytes)}.", err=True)
    if yes:
        return True
    if not _asks():
        raise UsageError("Nobody can be asked here. Give --yes to delete it without a question.")
    return typer.confirm("Delete all of it for good?", err=True)


def _asks() -> bool:
    """Return whether there is somebody to ask."""
    return sys.stdin.isatty()
