"""`parenting doctor`: examine the installation, the data folder and the database."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

from parenting.commands.errors import exit_on_interrupt, friendly_errors, settings
from parenting.commands.printing import say
from parenting.envs.people_text import printable
from parenting.server.doctor.examination import examine
from parenting.server.doctor.findings import Finding, State, error, worst
from parenting.server.errors import ServerError, SetupError
from parenting.server.settings import Settings
from parenting.server.store import high_water
from parenting.server.store.url import database_url

EXIT_CODES = {State.OK: 0, State.WARNING: 1, State.ERROR: 2}
SETTINGS = "Correct it; docs/commands.md lists the settings."
STYLES = {State.OK: "green", State.WARNING: "yellow", State.ERROR: "red"}


def doctor(
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the findings as JSON and nothing else.")
    ] = False,
    accept: Annotated[
        bool,
        typer.Option(
            "--accept",
            help="First accept a loss: what the database holds now counts as all that it ever held.",
        ),
    ] = False,
) -> None:
    """Examine the installation, the data folder and the database, and name a remedy for each fault.

    Without --accept it changes nothing, and it works where the database is missing, damaged, locked or away.

    Exit codes: 0 all is well; 1 there are warnings; 2 there are errors; 130 stopped by Ctrl-C.

    Example: parenting doctor
    """
    with exit_on_interrupt(), friendly_errors():
        found = []
        for finding in _findings(accept):
            found.append(finding)
            if not as_json:
                _show(finding)
    if as_json:
        say(json.dumps([finding.row() for finding in found]))
    raise typer.Exit(EXIT_CODES[worst(found)])


def _findings(accept: bool) -> Iterator[Finding]:
    """Yield what there is to say; of wrong settings alone, where nothing else can be looked at."""
    try:
        chosen = settings()
        database_url(chosen.url)
    except ServerError as refused:
        yield from (error("settings", said, SETTINGS) for said in refused.message.splitlines())
        return
    if accept:
        _accept(chosen)
    yield from examine(chosen)


def _accept(chosen: Settings) -> None:
    """Reset the high-water mark of the database.

    Raises:
        SetupError: the database is damaged, or is not a file.
    """
    url = database_url(chosen.url)
    if url.get_backend_name() != "sqlite":
        raise SetupError("--accept is for SQLite: a PostgreSQL database has no mark beside it.")
    high_water.accept(Path(str(url.database)))


def _show(finding: Finding) -> None:
    console = Console(soft_wrap=True, highlight=False)
    state = Text(f"{finding.state:<8}", style=STYLES[finding.state])
    console.print(state + Text(printable(f"{finding.name}: {finding.said}")))
    if finding.remedy is not None:
        console.print(Text(printable(f"{'':8}-> {finding.remedy}")))
