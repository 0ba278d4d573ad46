"""`parenting doctor`: examine the installation, the data folder and the database."""

from __future__ import annotations

import json
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

from parenting.commands.errors import exit_on_interrupt, friendly_errors, settings
from parenting.server.doctor.examination import examine
from parenting.server.doctor.findings import Finding, State, worst

EXIT_CODES = {State.OK: 0, State.WARNING: 1, State.ERROR: 2}
STYLES = {State.OK: "green", State.WARNING: "yellow", State.ERROR: "red"}


def doctor(
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the findings as JSON and nothing else.")
    ] = False,
) -> None:
    """Examine the installation, the data folder and the database, and name a remedy for each fault.

    It changes nothing, and it works where the database is missing, damaged, locked or away.

    Exit codes: 0 all is well; 1 there are warnings; 2 there are errors; 130 stopped by Ctrl-C.

    Example: parenting doctor
    """
    with exit_on_interrupt(), friendly_errors():
        found = []
        for finding in examine(settings()):
            found.append(finding)
            if not as_json:
                _show(finding)
    if as_json:
        typer.echo(json.dumps([finding.row() for finding in found]))
    raise typer.Exit(EXIT_CODES[worst(found)])


def _show(finding: Finding) -> None:
    console = Console(soft_wrap=True, highlight=False)
    state = Text(f"{finding.state:<8}", style=STYLES[finding.state])
    console.print(state + Text(f"{finding.name}: {finding.said}"))
    if finding.remedy is not None:
        console.print(Text(f"{'':8}-> {finding.remedy}"))
