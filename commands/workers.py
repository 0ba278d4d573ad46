"""`parenting workers`: list the workers that are alive, the runs of each, its load and its memory."""

from __future__ import annotations

import json
import sys
from typing import Annotated, Any

import typer
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from parenting.commands.database import database
from parenting.commands.errors import friendly_errors
from parenting.commands.printing import cell, say
from parenting.server.damage import sound
from parenting.server.tables import Worker
from parenting.server.workers import Figures, living

COLUMNS = ("worker", "since", "runs", "in memory", "load", "memory", "waited")
WIDE = 120
"""The width when the output is not a terminal."""


def workers(
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the workers as JSON, and nothing else.")
    ] = False,
) -> None:
    """List the workers that are alive: the runs that each raises, its load and its memory.

    `in memory` are the agents that it holds there; the others wait and are in their checkpoints. `load` is
    the share of a core that it takes, and `waited` the longest time that a turn which was due waited for it,
    both since its last sign of life but one. `parenting runs` says which worker raises which run.

    Exit codes: 0 listed, or none is alive; 2 the database does not exist or is not up to date.

    Example: parenting workers --json
    """
    with friendly_errors(), database() as db:
        found = living(db)
    if as_json:
        say(json.dumps([_fields(row) for row in found]))
    elif not found:
        say("No worker is alive. Start one: `parenting worker`")
    else:
        Console(width=None if sys.stdout.isatty() else WIDE).print(_table([_fields(row) for row in found]))


def _fields(row: Worker) -> dict[str, Any]:
    times = {name: sound(row, name) for name in ("started", "heartbeat")}
    figures = {name: sound(row, name) for name in Figures._fields}
    return {"name": row.name, **{name: at and at.isoformat() for name, at in times.items()}, **figures}


def _table(rows: list[dict[str, Any]]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, padding=(0, 1))
    for column in COLUMNS:
        table.add_column(column, justify="left" if column in ("worker", "since") else "right")
    for row in rows:
        shown = (
            row["name"],
            _said(row["started"] and row["started"][:19].replace("T", " "), "{}"),
            _said(row["runs"], "{}"),
            _said(row["lives"], "{}"),
            _said(row["busy"], "{:.0%}"),
            _said(row["memory"] and row["memory"] / 1e6, "{:.0f} MB"),
            _said(row["waited"] and 1000 * row["waited"], "{:.0f} ms"),
        )
        table.add_row(*(Text(cell(text)) for text in shown))
    return table


def _said(value: float | str | None, form: str) -> str:
    """Return a figure as text; a worker of an older version says none, and a damaged one counts as none."""
    return "" if value is None else form.format(value)
