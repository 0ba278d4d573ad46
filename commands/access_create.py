"""`parenting access create`: make a link for a person, or a token for a program."""

from __future__ import annotations

import json
from enum import StrEnum
from typing import Annotated

import typer

from parenting.commands.database import database
from parenting.commands.errors import UsageError, friendly_errors, settings
from parenting.commands.options import of_a_run
from parenting.commands.printing import say
from parenting.envs.people_text import read_name
from parenting.server.access.roles import Role
from parenting.server.access.tokens import DAYS, TokenKind, make
from parenting.server.public import address_of


class What(StrEnum):
    """The kinds that can be made here."""

    LINK = "link"
    TOKEN = "token"


KINDS: dict[What, TokenKind] = {What.LINK: "link", What.TOKEN: "program"}


def command(
    what: Annotated[What, typer.Argument(help="link: an address for a person; token: for a program.")],
    role: Annotated[
        Role | None,
        typer.Option(help="What it may do.", show_default="parent for a link, researcher for a token"),
    ] = None,
    run: Annotated[
        int | None,
        typer.Option(
            min=1, callback=of_a_run, help="The only run that it reaches.", show_default="all of them"
        ),
    ] = None,
    name: Annotated[str | None, typer.Option(help="What to call it in the list.")] = None,
    days: Annotated[
        float | None,
        typer.Option(min=0.001, help="Days for which it is valid.", show_default="30; 90 for a token"),
    ] = None,
    client_id: Annotated[
        str | None,
        typer.Option(help="The name under which a parent's program answers.", show_default="a random one"),
    ] = None,
    url: Annotated[
        str | None,
        typer.Option(
            help="The server's address.",
            show_default="http://localhost:PORT, or https://HOST of a public server",
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """Make a link for a person or a token for a program. It is shown once: only its hash is stored.

    A parent's link opens one run, and has one seat: whoever opens it last has it. A program sends its token
    in the header `Authorization: Bearer TOKEN`; commands take it from PARENTING_TOKEN.

    Exit codes: 0 made; 2 there is no such run, or an option is wrong.

    Example: parenting access create link --run 3 --name "Group A, seat 1"
    """
    with friendly_errors():
        kind, chosen = KINDS[what], role or (Role.PARENT if what is What.LINK else Role.RESEARCHER)
        called = _read_name(name)
        configured = settings()
        base = (url or address_of(configured, configured.port)).rstrip("/")
        with database() as db:
            made = make(
                db,
                kind,
                chosen,
                run=run,
                name=called,
                days=DAYS[kind] if days is None else days,
                client_id=client_id,
                made_by="parenting access create",
            )
    secret = f"{base}/open?token={made.secret}" if what is What.LINK else made.secret
    if as_json:
        say(json.dumps({"id": made.token.public_id, what.value: secret, "client_id": made.token.client_id}))
        return
    say(secret)
    until = f"{made.token.expires:%Y-%m-%d %H:%M} UTC"
    say(f"Valid until {until}. To end it: parenting access revoke {made.token.public_id}", err=True)


def _read_name(name: str | None) -> str | None:
    try:
        return read_name(name) if name else None
    except ValueError as error:
        raise UsageError(f"--name: {error}.") from None
