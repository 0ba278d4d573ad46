"""`parenting export`: write whole runs with all that belongs to them, or one table of a run."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from parenting._plural import counted
from parenting.commands.audited import note_export
from parenting.commands.database import database
from parenting.commands.errors import UsageError, exit_on_interrupt, friendly_errors
from parenting.commands.export_table import export_table
from parenting.commands.options import of_a_run
from parenting.commands.printing import say
from parenting.commands.progress import bar
from parenting.server.exports import Format, Part


class Form(StrEnum):
    """The formats of exports."""

    WHOLE = "2"
    FIRST = "1"
    JSONL = "jsonl"
    CSV = "csv"


TABLE = {Form.FIRST: Format.JSONL, Form.JSONL: Format.JSONL, Form.CSV: Format.CSV}
"""The formats of one table."""

ENDINGS = {
    ".jsonl": Form.JSONL,
    ".ndjson": Form.JSONL,
    ".json": Form.JSONL,
    ".csv": Form.CSV,
    ".zip": Form.WHOLE,
}
"""The ends of names and the formats that they stand for."""
OTHERS = (
    *(".parquet", ".feather", ".arrow", ".xlsx", ".xls", ".ods", ".tsv", ".db", ".sqlite", ".pkl"),
    *(".tar", ".gz", ".tgz", ".bz2", ".xz", ".zst", ".7z", ".rar"),
)
"""The ends of names of formats that nothing is written in."""


def export(
    run: Annotated[
        list[int] | None,
        typer.Argument(
            min=1,
            callback=of_a_run,
            help="Numbers of runs; `parenting runs` lists them.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FOLDER|FILE",
            help="A new folder, or a file: with .zip at its end for whole runs, else for one table.",
            show_default="standard output",
        ),
    ] = None,
    of: Annotated[
        Part | None, typer.Option(help="One table alone; events are the log.", show_default="whole runs")
    ] = None,
    format_: Annotated[
        Form | None,
        typer.Option(
            "--format",
            help="2: whole runs; 1 or jsonl: one table of one run as JSON lines; csv: as CSV.",
            show_default="2, or one table by the name of the file",
        ),
    ] = None,
    check: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER|ZIP",
            help="Check an export from its files alone, without a database, and write nothing.",
            show_default=False,
        ),
    ] = None,
    minari: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Write the episodes of one run as a local dataset of Minari with this name.",
            show_default=False,
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace what is there.")] = False,
) -> None:
    """Write whole runs into a folder or a zip: answers, questions, log, metrics, a codebook and a manifest.

    An export holds what there is up to now; the runs may go on meanwhile. It is written completely or not at
    all. `parenting import` reads it into another database, where it is replayed to the same bits.

    With --of, with --format jsonl or csv, or without --out, one table of one run is written.

    --minari writes the agent's steps for programs of offline reinforcement learning, into the folder of
    Minari's local datasets; `pip install 'parenting[minari]'` adds what it needs.

    --check recomputes hashes, counts, chains, corrections and X of an export from its files. It shares no
    code with what wrote them, and needs no database.

    Exit codes: 0 written, or nothing found; 1 --check found something; 2 a run or the database does not
    exist, or the file cannot be written; 130 stopped by Ctrl-C.

    Example: parenting export 1 2 3 --out study.zip
    """
    with exit_on_interrupt(), friendly_errors():
        if check is not None:
            _check(check, run or out)
        runs = list(dict.fromkeys(run or []))  # a run that is named twice is one
        if not runs:
            raise UsageError("Name a run; `parenting runs` lists them.")
        if minari is not None:
            _episodes(runs, minari, out or of or format_)
            return
        form = format_ or _form(out, of)
        if out is not None:
            _check_name(out, form)
        if form is not Form.WHOLE:
            if len(runs) > 1:
                raise UsageError(
                    "One table is of one run. Name one, or export whole runs into a folder or a zip."
                )
            export_table(runs[0], out, of or Part.ANSWERS, TABLE[form], force)
            return
        if out is None or of is not None:
            raise UsageError(
                "--of: one table has the format jsonl or csv."
                if of is not None
                else "--out: name a new folder, or a file that ends with .zip."
            )
        _whole(runs, out, force)


def _check(path: Path, others: object) -> NoReturn:
    """Print the report of an audit, and exit.

    Raises:
        UsageError: something else was asked for as well, or there is nothing at the path.
    """
    from parenting.audit import audit

    if others:
        raise UsageError("--check reads an export and writes none: give it alone.")
    if not path.exists():
        raise UsageError(f"--check: {path} is not there.")
    found = audit(path)
    say(str(found))
    raise typer.Exit(0 if found.sound else 1)


def _episodes(runs: list[int], name: str, others: object) -> None:
    """Write the episodes of a run as a dataset of Minari.

    Raises:
        UsageError: several runs, or something else was asked for as well.
    """
    if others or len(runs) > 1:
        raise UsageError(
            "--minari writes the episodes of one run, and takes neither --out, --of nor --format."
        )
    from parenting.server.archive.minari_dataset import lived_run, write_minari

    with database() as db, bar("episodes") as show:
        written = write_minari(lived_run(db, runs[0]), name, show)
        note_export(db, runs, "episodes for Minari")
    say(
        f"{counted(written.episodes, 'episode')} with {counted(written.steps, 'step')} of run {runs[0]} "
        f"written to {written.folder}. Read them: minari.load_dataset({name!r})"
    )
    if written.left_out:
        say(f"{counted(written.left_out, 'episode')} left out, since not all of their moves are known.")


def _form(out: Path | None, of: Part | None) -> Form:
    """Return the format that the other options mean."""
    ending = "" if out is None else out.suffix.lower()
    if out is None or of is not None:
        return Form.CSV if ending == ".csv" else Form.JSONL
    return ENDINGS.get(ending, Form.WHOLE)


def _check_name(out: Path, form: Form) -> None:
    """Refuse a name that promises another format than the one that is written.

    Raises:
        UsageError: it does.
    """
    formats = "A folder or FILE.zip is of whole runs, FILE.jsonl and FILE.csv are one table"
    if str(out) == "-":
        raise UsageError(f"--out: - is not a name of a file. Leave --out out for standard output. {formats}.")
    ending = out.suffix.lower()
    meant = ENDINGS.get(ending, form)
    if ending in OTHERS:
        raise UsageError(f"--out: {out} ends with {ending}, and no such file is written. {formats}.")
    if (meant is Form.WHOLE) != (form is Form.WHOLE) or (meant is Form.CSV) != (form is Form.CSV):
        whole = "whole runs are" if form is Form.WHOLE else f"one table as {TABLE[form]} is"
        raise UsageError(f"--out: {out} ends with {ending}, and {whole} asked for. {formats}.")


def _whole(runs: list[int], out: Path, force: bool) -> None:
    from parenting.server.archive.target import MANIFEST, target
    from parenting.server.archive.writing import write_export

    with database() as db, target(out, force) as files, bar("rows") as show:
        written = write_export(db, runs, files, show)
        note_export(db, runs, f"the whole run as {'zip' if out.suffix.lower() == '.zip' else 'folder'}")
    counts = [run["counts"] for run in written["runs"]]
    told = ", ".join(
        counted(sum(one[f"{name}s"] for one in counts), name) for name in ("answer", "question", "event")
    )
    say(
        f"{told} of run{'s' * (len(counts) > 1)} {', '.join(str(one['number']) for one in written['runs'])} "
        f"written to {out}."
    )
    for left in written["left_out"]:
        say(f"{left['file']} is left out: {left['why']}. To have it: {left['remedy']}")
    say(f"SHA-256 of {MANIFEST}: {files.written[MANIFEST].sha256}. Publish it with the data.")
