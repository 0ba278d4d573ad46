"""`parenting access open`: print an address that lets a browser in."""

from __future__ import annotations

import webbrowser
from typing import Annotated

import typer

from parenting.commands.database import database
from parenting.commands.errors import friendly_errors, settings
from parenting.commands.printing import say
from parenting.server.access.roles import Role
from parenting.server.access.tokens import make
from parenting.server.public import address_of


def command(
    url: Annotated[
        str | None,
        typer.Option(
            help="The server's address.",
            show_default="http://localhost:PORT, or https://HOST of a public server",
        ),
    ] = None,
    browser: Annotated[bool, typer.Option("--browser", help="Open the address in a browser, too.")] = False,
    days: Annotated[
        float, typer.Option(min=0.001, max=30, help="Days for which the address can be opened.")
    ] = 1.0,
) -> None:
    """Print an address that lets one browser in as the researcher, once. Servers that run take it at once.

    In a container: docker compose exec web parenting access open

    Exit codes: 0 printed; 2 the database does not exist or is not up to date.

    Example: parenting access open --url http://localhost:8000
    """
    with friendly_errors():
        chosen = settings()
        base = url or address_of(chosen, chosen.port)
        with database() as db:
            made = make(db, "opening", Role.RESEARCHER, days=days, made_by="parenting access open")
    address = f"{base.rstrip('/')}/open?token={made.secret}"
    say(address)
    if browser:
        webbrowser.open(address)
