"""`parenting resume`: let a paused, ended or failed run go on."""

from __future__ import annotations

from parenting.commands.database import database
from parenting.commands.errors import friendly_errors, settings
from parenting.commands.options import RunNumber
from parenting.commands.printing import say
from parenting.server.runs import set_status
from parenting.server.statuses import RunStatus


def resume(
    run: RunNumber,
) -> None:
    """Let a paused, ended or failed run go on.

    An ended or failed run goes on from its last good checkpoint. Its withdrawn questions are asked again. The
    reason of a failure stays in its log, on its dashboard. A worker has to run: `parenting up` or
    `parenting worker`.

    Exit codes: 0 it goes on; 2 there is no such run, it has finished, or no more may live.

    Example: parenting resume 3
    """
    with friendly_errors(), database() as db:
        set_status(db, run, RunStatus.ACTIVE, most=settings().runs)
    say(f"Run {run} goes on as soon as a worker takes it up.")
