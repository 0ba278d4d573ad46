"""`parenting person name`: keep the name of a person, or an id of another system, apart from answers."""

from __future__ import annotations

from typing import Annotated

import typer

from parenting.commands.database import database
from parenting.commands.errors import UsageError, friendly_errors
from parenting.commands.printing import say
from parenting.envs.people_text import read_name
from parenting.server.persons import name_person


def command(
    pseudonym: Annotated[str, typer.Argument(help="A pseudonym; `parenting person list` lists them.")],
    name: Annotated[str, typer.Option(help="The person's name.", show_default="none")] = "",
    external_id: Annotated[
        str, typer.Option("--external-id", help="Their id in another system.", show_default="none")
    ] = "",
) -> None:
    """Keep what you know a person by; what is left out is removed. No export holds it.

    Exit codes: 0 kept; 2 there is no such person, or the name cannot be stored.

    Example: parenting person name p7k2m9xq4t --external-id study-7-012
    """
    with friendly_errors():
        kept = _read("--name", name), _read("--external-id", external_id)
        with database() as db:
            name_person(db, pseudonym, *kept)
    told = ", ".join(one for one in kept if one)
    say(f"Of {pseudonym} is known: {told}." if told else f"Of {pseudonym} nothing more is known.")


def _read(option: str, text: str) -> str | None:
    try:
        return read_name(text) if text else None
    except ValueError as error:
        raise UsageError(f"{option}: {error}.") from None
