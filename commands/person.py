"""`parenting person`: list the people who answered, by their pseudonyms."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated

import typer

from parenting._plural import counted
from parenting.commands.database import database
from parenting.commands.errors import friendly_errors
from parenting.commands.printing import cell, say
from parenting.server.export import iso_time
from parenting.server.reads.persons import Known, persons


def person(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """List the people who answered: pseudonym, name if one was given, answers and runs of each.

    Everybody who answers has a pseudonym from the first answer on, one for each browser unless several are
    known to be one person's. `parenting person name` keeps a name or an id of another system, apart from all
    that they said, and `parenting person delete` deletes their data.

    Exit codes: 0 listed; 2 the database does not exist or is not up to date.

    Example: parenting person --json
    """
    with friendly_errors(), database() as db:
        found = persons(db)
    if as_json:
        say(
            json.dumps(
                [asdict(one) | {"first": iso_time(one.first), "last": iso_time(one.last)} for one in found]
            )
        )
        return
    for one in found:
        say(_said(one))
    if not found:
        say("Nobody has answered yet.")


def _said(one: Known) -> str:
    known = ", ".join(cell(told) for told in (one.name, one.external_id) if told)
    runs = ", ".join(map(str, one.runs)) or "none"
    what = f"{counted(one.answers, 'answer')} in runs {runs}"
    since = "" if one.last is None else f", last {one.last:%Y-%m-%d %H:%M} UTC"
    state = "; being deleted" if one.deleting else ""
    return f"{one.pseudonym}{f' ({known})' if known else ''}: {what}{since}{state}."
