"""`parenting worker`: train the agents of the runs in the database."""

from __future__ import annotations

from typing import Annotated

import typer

from parenting.commands.database import require_file, tell_mark
from parenting.commands.errors import friendly_errors, settings
from parenting.commands.options import AfterFd
from parenting.commands.printing import say
from parenting.server.db import connect
from parenting.server.lifeline import follow, wait_at
from parenting.server.log import set_up_log
from parenting.server.migrate import require_current
from parenting.server.settings import Settings
from parenting.server.store.private import make_files_private
from parenting.server.workers import SILENT_SECONDS, alive, is_here


def worker(
    check: Annotated[
        bool,
        typer.Option(
            "--check", help="Only check whether a worker of this machine is alive: exit code 0 if so, else 1."
        ),
    ] = False,
    after_fd: AfterFd = None,
) -> None:
    """Train the agents of the runs in the database until Ctrl-C.

    Each run continues exactly where the last worker stopped.

    Example: parenting worker
    """
    if check:
        raise typer.Exit(_check())
    follow()
    make_files_private()
    with friendly_errors("worker"):
        chosen = settings()
        if after_fd is None:
            require_file(chosen)
        set_up_log(chosen, "worker")
        if after_fd is None:  # else `up` tells it
            tell_mark(chosen)
        from parenting.server.worker_process import (
            main,  # loads torch, which takes a second, so the settings are checked before
        )

        wait_at(after_fd)
        main(chosen)


def _check() -> int:
    """Return the exit code of a health check. Workers of other machines do not count."""
    with friendly_errors():
        names = [name for name in _alive(settings()) if is_here(name)]
    if not names:
        say(
            f"No worker of this machine has given a sign of life for {SILENT_SECONDS:g} s. "
            "Start one: `parenting worker`",
            err=True,
        )
        return 1
    say(f"Alive: {', '.join(names)}")
    return 0


def _alive(chosen: Settings) -> list[str]:
    require_file(chosen)
    db = connect(chosen)
    try:
        require_current(db)
        return list(alive(db))
    finally:
        db.close()
