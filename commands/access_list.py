"""`parenting access list`: list tokens, links and sessions."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Any

import typer
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from parenting.commands.database import database
from parenting.commands.errors import friendly_errors
from parenting.commands.printing import cell, say
from parenting.commands.workers import WIDE
from parenting.server.access.sessions import list_sessions
from parenting.server.access.tables import AccessSession, AccessToken
from parenting.server.access.tokens import list_tokens
from parenting.server.damage import sound
from parenting.server.export import iso_time

FIELDS = ("kind", "role", "run", "name", "created", "expires", "last_used", "state")
AllOfThem = Annotated[
    bool, typer.Option("--all", help="Also those that were used up, have expired or were revoked.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")]


def command(all_of_them: AllOfThem = False, as_json: AsJson = False) -> None:
    """List the tokens, links and sessions that are valid, the newest first.

    Exit codes: 0 listed; 2 the database does not exist or is not up to date.

    Example: parenting access list --all
    """
    with friendly_errors(), database() as db:
        now = db.clock()
        rows: list[AccessToken | AccessSession] = [
            *list_tokens(db, all_of_them),
            *list_sessions(db, all_of_them),
        ]
    found = [_fields(row, now) for row in rows]
    if as_json:
        say(json.dumps(found))
    elif not found:
        say(
            "Nobody may come in by a browser yet. `parenting access open` prints an address that lets you in."
        )
    else:
        Console(width=None if sys.stdout.isatty() else WIDE).print(_table(found))


def _fields(row: AccessToken | AccessSession, now: datetime) -> dict[str, Any]:
    kind = sound(row, "kind") if isinstance(row, AccessToken) else "session"
    told = {
        "id": sound(row, "public_id"),
        "kind": kind,
        "run": sound(row, "run_id"),
        "state": _state(row, now),
    }
    told |= {name: sound(row, name) for name in ("role", "name", "client_id")}
    return told | {name: iso_time(sound(row, name)) for name in ("created", "expires", "last_used")}


def _state(row: AccessToken | AccessSession, now: datetime) -> str:
    if sound(row, "revoked") is not None:
        return "revoked"
    if isinstance(row, AccessToken) and sound(row, "used") is not None:
        return "used"
    expires = sound(row, "expires")
    return "valid" if expires is not None and expires > now else "expired"


def _table(rows: Sequence[dict[str, Any]]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, padding=(0, 1))
    for column in ("id", *FIELDS):
        table.add_column(column.replace("_", " "), no_wrap=column == "id")
    for row in rows:
        shown = {**row, **{name: _minute(row[name]) for name in ("created", "expires", "last_used")}}
        table.add_row(*(Text(cell(_said(shown[column]))) for column in ("id", *FIELDS)))
    return table


def _minute(time: str | None) -> str:
    return "" if time is None else time[:16].replace("T", " ")


def _said(value: object) -> str:
    return "" if value is None else str(value)
