"""`parenting runs deleted`: list what is left of deleted runs."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from parenting._plural import counted
from parenting.commands.database import database
from parenting.commands.errors import friendly_errors
from parenting.commands.printing import say
from parenting.server.deletion import tombstones
from parenting.server.export import iso_time
from parenting.server.sizes import size_text


def command(
    limit: Annotated[int, typer.Option(min=1, max=10_000, help="List at most this many.")] = 50,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """List what is left of deleted runs, the largest number first. Nothing in it was written by people.

    Exit codes: 0 listed; 2 the database does not exist or is not up to date.

    Example: parenting runs deleted
    """
    with friendly_errors(), database() as db:
        found = tombstones(db, limit=limit)
    if as_json:
        times = ("created", "deleted", "gone")
        told = [
            {"run": one.id, "public_id": one.public_id, "held": one.held}
            | {name: iso_time(getattr(one, name)) for name in times}
            for one in found
        ]
        say(json.dumps(told))
        return
    for one in found:
        held = one.held
        what = f"{held['world']}, {counted(held['answers'], 'answer')}, {size_text(held['bytes'])}"
        say(f"Run {one.id} ({one.public_id}): {what}; deleted {one.deleted:%Y-%m-%d %H:%M} UTC.")
    if not found:
        say("No run was deleted.")
