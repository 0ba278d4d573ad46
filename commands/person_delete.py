"""`parenting person delete`: delete one person's data for good, after it was asked."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from parenting._plural import counted
from parenting.commands.database import database
from parenting.commands.errors import UsageError, exit_on_interrupt, friendly_errors, settings
from parenting.commands.printing import say
from parenting.server.backups.making import FOLDER
from parenting.server.db import Database
from parenting.server.erasure import Plan, finish, nameless, plan, under_way
from parenting.server.errors import NotFound
from parenting.server.settings import Settings
from parenting.server.store.url import database_url


def command(
    pseudonym: Annotated[str, typer.Argument(help="A pseudonym; `parenting person list` lists them.")],
    yes: Annotated[bool, typer.Option("--yes", help="Ask nothing; for scripts.")] = False,
    copies: Annotated[
        bool, typer.Option("--remove-backups", help="Remove the files of the folder of backups, too.")
    ] = False,
) -> None:
    """Say what will be deleted of a person, ask, and delete it for good.

    An agent that they alone raised is deleted as a whole. From one that others raised, too, their answers go:
    X is rebuilt without them, and all earlier checkpoints and snapshots are removed. Its weights were trained
    on these answers before, and that stays so. The chain of hashes keeps a hash of each answer, which tells
    nothing, so `parenting verify` goes on holding; `parenting replay` ends before the first of them.

    At the end the database's file is written afresh, so that no deleted row is left in it; no other program
    can write meanwhile. Whoever was stopped in the middle, or killed, may give the command again; a worker
    goes on, too.

    Exit codes: 0 deleted; 1 not deleted, as was answered; 2 there is no such person, or nobody can be asked
    and --yes is missing; 3 deleted, but the database's log could not be emptied; 130 stopped by Ctrl-C.

    Example: parenting person delete p7k2m9xq4t
    """
    with exit_on_interrupt(), friendly_errors(), database() as db:
        done = _delete(db, pseudonym, yes, copies)
    if not done:
        say("Another program reads the database, so its log holds them yet; a worker tries again.", err=True)
        raise typer.Exit(3)


def _delete(db: Database, pseudonym: str, yes: bool, copies: bool) -> bool:
    """Delete a person's data; return whether the store's file was overwritten as well.

    Raises:
        NotFound: there is no such person, and no deletion was stopped after their names were gone.
        Exit: it was not confirmed.
    """
    files = _copies(settings())
    try:
        found = plan(db, pseudonym)
    except NotFound:
        rest = nameless(db)
        if not rest:
            raise
        _remove(files if copies else ())
        done = min([finish(db, person) for person in rest])  # each of them, whatever the others say
        say("A deletion that was stopped is finished: the file was yet to be written afresh.")
        return done
    goes_on = pseudonym in [one.pseudonym for one in under_way(db)]
    if not goes_on and not _confirmed(found, files, copies, yes):
        say(f"Nothing of {pseudonym} is deleted.")
        raise typer.Exit(1)
    from parenting._process import settle
    from parenting.server.erasing import delete_person

    settle()
    _remove(files if copies else ())  # before: a process that is killed at the end leaves nobody to name
    done = delete_person(db, pseudonym)
    say(f"The data of {pseudonym} are deleted.")
    return done


def _remove(files: Iterable[Path]) -> None:
    for file in files:
        file.unlink(missing_ok=True)


def _confirmed(found: Plan, files: list[Path], copies: bool, yes: bool) -> bool:
    """Say what will be deleted, and return whether it may be.

    Raises:
        UsageError: nobody can be asked.
    """
    for line in _said(found, files, copies):
        say(line, err=True)
    if yes:
        return True
    if not _asks():
        raise UsageError("Nobody can be asked here. Give --yes to delete it without a question.")
    return typer.confirm("Delete all of it for good?", err=True)


def _said(found: Plan, files: list[Path], copies: bool) -> list[str]:
    lines = [f"{found.pseudonym} gave {counted(found.answers, 'answer')}."]
    if found.alone:
        lines.append(f"Deleted as a whole, since nobody else answered: runs {_list(found.alone)}.")
    if found.shared:
        lines.append(
            f"Their answers leave X, and earlier checkpoints and snapshots go: runs {_list(found.shared)}. "
            "The weights were trained on these answers before."
        )
    if found.began_with:
        lines.append(
            f"Not touched: runs {_list(found.began_with)} began with answers of these runs; their X holds "
            "copies without a name. `parenting runs delete` deletes them."
        )
    if files:
        verb = "Removed, too" if copies else "Not touched (--remove-backups removes them)"
        lines.append(f"{verb}: {', '.join(map(str, files))}.")
    return lines


def _list(runs: object) -> str:
    return ", ".join(map(str, runs)) if isinstance(runs, list | tuple) else str(runs)


def _copies(chosen: Settings) -> list[Path]:
    """Return the files in the folder of backups, each of which may hold the same data."""
    url = database_url(chosen.url)
    beside = Path(url.database or "").parent if url.get_backend_name() == "sqlite" else chosen.data
    return sorted(file for file in (beside / FOLDER).glob("*") if file.is_file())


def _asks() -> bool:
    """Return whether there is somebody to ask."""
    return sys.stdin.isatty()
