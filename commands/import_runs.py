"""`parenting import`: add the runs of an export to the database, from where they go on and are replayed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from parenting._plural import counted
from parenting.commands.before_run import PRETRAIN
from parenting.commands.database import database
from parenting.commands.errors import UsageError, exit_on_interrupt, friendly_errors, settings
from parenting.commands.import_table import OfTable, import_one
from parenting.commands.level_file import LEVEL
from parenting.commands.printing import say
from parenting.commands.progress import bar
from parenting.server.archive.importing import import_export
from parenting.server.notify import Notifier


def import_runs(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER|ZIP|JSONL",
            help="What `parenting export --out` has written; or one table of answers (format 1).",
        ),
    ],
    seed: Annotated[
        str | None, typer.Option(help="Of one table: the seed of its run.", show_default=False)
    ] = None,
    preset: Annotated[
        str | None,
        typer.Option(help="Of one table: the preset of its run.", show_default="conservative"),
    ] = None,
    level: Annotated[str | None, LEVEL] = None,
    changes: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Of one table: a setting that its run had."),
    ] = None,
    events: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Of one table: the log beside it, which `parenting export RUN --of events` has written.",
            show_default="nobody changed anything",
        ),
    ] = None,
    pretrain: Annotated[str | None, PRETRAIN] = None,
) -> None:
    """Add the runs of an export: settings, questions, answers, log, metrics, and the last checkpoint.

    They are replayed to the same bits on the same kind of processor, and go on where they were: a run that
    was active is taken up by a worker. Each keeps its public id, unless this database has that run or had it.
    All runs are added or none.

    One table of answers (a file that ends with .jsonl, .ndjson or .json) has no seed and no config: give
    those of its run. The run is lived again with them, and added if the agent asks every question of the
    table at its tick.

    Exit codes: 0 added; 2 it is not an export, is damaged, needs what is not installed here, or is a table
    of a run with other settings; 130 stopped by Ctrl-C, with nothing added.

    Example: parenting import study.zip
    """
    with exit_on_interrupt(), friendly_errors():
        given = OfTable(seed, preset, level, changes, events, pretrain)
        with database() as db:
            if not path.exists():
                raise UsageError(f"{path} is not there.")
            if path.suffix.lower() in (".jsonl", ".ndjson", ".json"):
                runs = [import_one(db, path, given)]
            else:
                given.refuse(path)
                with bar("bytes") as checked, bar("rows") as show:
                    runs = import_export(db, path, checked, show, settings().runs)
        Notifier(settings().data, "worker").notify()
    for run in runs:
        other = "" if run.public_id == run.was else f" It was {run.was}, which this database has or had."
        say(
            f"Run {run.number} is imported with {counted(run.answers, 'answer')}. "
            f"Its page: /runs/{run.public_id}.{other}"
        )
