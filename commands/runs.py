"""`parenting runs`: list the runs of the database, and who waits for whom in each."""

from __future__ import annotations

import json
import sys
from typing import Annotated

import typer
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from parenting.commands.database import database
from parenting.commands.errors import friendly_errors
from parenting.commands.printing import cell, say
from parenting.server.reads.listing import Order, Wanted, find_runs
from parenting.server.reads.schemas import run_schemas
from parenting.server.schemas import DamagedSchema, RunSchema
from parenting.server.sizes import size_text, sizes
from parenting.server.statuses import STATE_LABELS, RunState

WHAT = ("run", "name", "tags", "world", "level", "preset", "parent")
COLUMNS = (*WHAT, "now", "stage", "tick", "answers", "size", "optimal", "worker")
NARROW = ("name", "level", "parent", "preset", "tags", "size", "worker")
"""Columns that a terminal narrower than `ENOUGH` characters does not show."""
ENOUGH, WIDE = 120, 200
"""`WIDE` is the width when the output is not a terminal."""


def runs(
    search: Annotated[
        str, typer.Option(help="Only runs with each of these words, or of this number.", show_default="all")
    ] = "",
    tag: Annotated[str | None, typer.Option(help="Only runs with this tag.", show_default="any")] = None,
    world: Annotated[str | None, typer.Option(help="Only runs in this world.", show_default="any")] = None,
    sort: Annotated[Order, typer.Option(help="Their order.")] = Order.NEWEST,
    everything: Annotated[bool, typer.Option("--all", help="Archived runs, too.")] = False,
    limit: Annotated[int, typer.Option(min=1, max=10_000, help="List at most this many.")] = 50,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the runs as JSON, as in the API, and nothing else.")
    ] = False,
) -> None:
    """List the runs, newest first, with their progress, who waits for whom, disk space and worker of each.

    `parenting runs rename`, `describe`, `tag`, `archive` and `delete` keep them in order, and `parenting runs
    deleted` lists what is left of deleted ones.

    Exit codes: 0 listed; 2 the database does not exist or is not up to date.

    Example: parenting runs --tag pilot --sort answers
    """
    with friendly_errors(), database() as db:
        wanted = Wanted(search, tag, world, None if everything else False, sort)
        found = find_runs(db, wanted, None, limit).rows
        shown, space = run_schemas(db, found), sizes(db, [run.id for run in found])
    if as_json:
        say(json.dumps([run.model_dump(mode="json") for run in shown]))
    elif shown:
        console = Console(width=None if sys.stdout.isatty() else WIDE)
        console.print(_table(shown, space, console.width >= ENOUGH))
    elif wanted != Wanted(archived=False):
        say("No run is like this. `parenting runs --all` lists every run.")
    else:
        say("There are no runs yet. Start one on the pages: `parenting up`")


def _table(shown: list[RunSchema | DamagedSchema], space: dict[int, int], wide: bool) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, padding=(0, 1))
    columns = [column for column in COLUMNS if wide or column not in NARROW]
    for column in columns:
        table.add_column(column, justify="right" if column in ("run", "tick", "answers", "size") else "left")
    for run in shown:
        row = _row(run) | {"size": size_text(space[run.id])}
        table.add_row(*[Text(cell(row[column])) for column in columns])  # not as markup: a name may look so
    return table


def _row(run: RunSchema | DamagedSchema) -> dict[str, str]:
    if isinstance(run, DamagedSchema):
        return {**dict.fromkeys(COLUMNS, ""), "run": str(run.id), "world": "damaged", "now": run.damaged}
    return {
        "run": str(run.id),
        "name": run.name or "",
        "world": run.world,
        "level": run.level,
        "parent": run.parent,
        "now": now(run),
        "stage": f"{run.maturity} of {run.config['stages']}",
        "tick": str(run.tick),
        "answers": str(run.standing) if run.goal is None else f"{run.standing} of {run.goal}",
        "optimal": "yes" if run.optimal else "no",
        "preset": run.preset,
        "tags": ", ".join(run.tags),
        "worker": run.raised_by or "",
    }


def now(run: RunSchema) -> str:
    """Say who waits for whom, or how the run ended."""
    if run.deleting is not None:
        return "being deleted"
    return run.status if run.state is RunState.OVER else STATE_LABELS[run.state]
