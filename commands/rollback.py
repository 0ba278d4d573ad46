"""`parenting rollback`: go on from an earlier tick of a run, as a new run."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from parenting.commands.database import database
from parenting.commands.errors import UsageError, friendly_errors, settings
from parenting.commands.options import RunNumber
from parenting.commands.printing import say
from parenting.server.errors import InvalidFieldsError
from parenting.server.notify import Notifier
from parenting.server.reads.schemas import run_schema
from parenting.server.rollback import roll_back


def rollback(
    run: RunNumber,
    to: Annotated[int, typer.Option(min=0, metavar="TICK", help="The last tick that both have in common.")],
    name: Annotated[
        str | None, typer.Option(help="A name for the new run.", show_default="the run's, and the tick")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the new run as JSON, as in the API, and nothing else.")
    ] = False,
) -> None:
    """Start a new run that goes on from an earlier tick of a run; that run stays as it is.

    The record up to the tick is copied: questions, answers and the operator's events. A worker lives these
    ticks again, bit for bit, and goes on from there. What the agent had not heard by then is asked again.

    Exit codes: 0 started; 2 there is no such run, it has not come to this tick, or no more may live.

    Example: parenting rollback 3 --to 120
    """
    with friendly_errors(), database() as db:
        try:
            new = roll_back(db, run, to, name, settings().runs)
        except InvalidFieldsError as error:
            raise UsageError(f"--to: {error.fields[0][1]}") from None
        shown = run_schema(db, new.id)
        Notifier(settings().data, "worker").notify()
    if as_json:
        say(json.dumps(shown.model_dump(mode="json")))
        return
    say(f"Run {new.id} goes on from tick {to} of run {run}. Its page: /runs/{new.public_id}")
