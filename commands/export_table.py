"""One table of a run, as `parenting export --of` writes it: JSON lines or CSV, whole or not at all."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import TextIO

from parenting._plural import counted
from parenting.commands.audited import note_export
from parenting.commands.database import database
from parenting.commands.errors import UsageError
from parenting.commands.printing import say
from parenting.commands.progress import bar
from parenting.server.backups.whole import file_at
from parenting.server.damage import sound
from parenting.server.exports import Format, Part, exported
from parenting.server.runs import stored_run

NOUNS = {Part.ANSWERS: "answer", Part.METRICS: "row", Part.EVENTS: "event"}


def export_table(run: int, out: Path | None, of: Part, form: Format, force: bool) -> None:
    """Write a table of a run to a file, or to standard output.

    Raises:
        NotFound: there is no such run.
        UsageError: the file exists, or cannot be written.
    """
    with database() as db:
        total = sound(stored_run(db, run), "answers") if of is Part.ANSWERS else None
        found = exported(db, run, of, form)
        note_export(db, [run], f"{of} as {form}")
        if out is None:
            _copy(found, sys.stdout, total, of)
            return
        with _whole(out, force) as file:
            written = _copy(found, file, total, of) - (form is Format.CSV)  # its head does not count
    say(f"{counted(written, NOUNS[of])} of run {run} written to {out}.")


def _copy(found: Iterator[str], file: TextIO, total: int | None, of: Part) -> int:
    """Copy line by line, and return the number of lines."""
    number = 0
    # On a terminal the lines themselves show the progress, and a bar would break them.
    with nullcontext(_quiet) if file.isatty() else bar(of.value) as show:
        for number, line in enumerate(found, start=1):
            file.write(line)
            show(number, total)
    file.flush()
    return number


def _quiet(done: int, total: int | None = None) -> None:
    """Show nothing."""


@contextmanager
def _whole(target: Path, force: bool) -> Iterator[TextIO]:
    """Open a file that takes its name once it is complete and safely stored.

    Raises:
        UsageError: the file exists, or its folder cannot be written to.
        SetupError: it is not a file but something else.
    """
    target = file_at(target)
    if target.exists() and not force:
        raise UsageError(f"--out: {target} exists already. Name another file, or give --force to replace it.")
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        with part.open("x", encoding="utf-8", newline="\n") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        part.replace(target)
    except OSError as error:
        raise UsageError(f"--out: {target} cannot be written: {error.strerror}.") from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
