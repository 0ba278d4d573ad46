"""`parenting import`: add the runs of an export to the database, from where they go on and are replayed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from parenting._plural import counted
from parenting.commands.database import database
from parenting.commands.errors import UsageError, exit_on_interrupt, friendly_errors, settings
from parenting.commands.printing import say
from parenting.commands.progress import bar
from parenting.server.archive.importing import import_export
from parenting.server.notify import Notifier


def import_runs(
    path: Annotated[
        Path, typer.Argument(metavar="FOLDER|ZIP", help="What `parenting export --out` has written.")
    ],
) -> None:
    """Add the runs of an export: settings, questions, answers, log, metrics, and the last checkpoint.

    They are replayed to the same bits on the same kind of processor, and go on where they were: a run that
    was active is taken up by a worker. Each keeps its public id, unless this database has that run or had it.
    All runs are added or none.

    Exit codes: 0 added; 2 it is not an export, is damaged, or needs what is not installed here; 130
    stopped by Ctrl-C, with nothing added.

    Example: parenting import study.zip
    """
    with exit_on_interrupt(), friendly_errors():
        with database() as db, bar("bytes") as checked, bar("rows") as show:
            _require_export(path)
            runs = import_export(db, path, checked, show)
        Notifier(settings().data, "worker").notify()
    for run in runs:
        other = "" if run.public_id == run.was else f" It was {run.was}, which this database has or had."
        say(
            f"Run {run.number} is imported with {counted(run.answers, 'answer')}. "
            f"Its page: /runs/{run.public_id}.{other}"
        )


def _require_export(path: Path) -> None:
    """Refuse what cannot be an export of whole runs, with a remedy.

    Raises:
        UsageError: it is not there, or is one table.
    """
    if not path.exists():
        raise UsageError(f"{path} is not there.")
    if path.suffix.lower() in (".jsonl", ".ndjson", ".json"):
        raise UsageError(
            f"{path}: one table of answers (format 1) has no level, config, seed, log or unanswered "
            "questions, so it is not a run. Begin a run with its answers: "
            f"parenting start WORLD --from-answers {path}"
        )
