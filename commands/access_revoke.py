"""`parenting access revoke`: end tokens, links and sessions."""

from __future__ import annotations

from typing import Annotated

import typer

from parenting.commands.database import database
from parenting.commands.errors import UsageError, friendly_errors
from parenting.commands.printing import say
from parenting.server.access.sessions import end_all
from parenting.server.access.tokens import revoke


def command(
    ids: Annotated[
        list[str] | None,
        typer.Argument(help="Ids of tokens, links or sessions; `parenting access list` shows them."),
    ] = None,
    sessions: Annotated[bool, typer.Option("--sessions", help="End all sessions of browsers.")] = False,
) -> None:
    """End tokens, links and sessions. Servers that run know it within a second.

    Whoever came in by a link that is revoked is out, too.

    Exit codes: 0 ended; 2 there is no such id; those before it are ended.

    Example: parenting access revoke 3sQv8hYJ2cT7mWk9xRzLpB
    """
    with friendly_errors():
        if not ids and not sessions:
            raise UsageError("ID: name what to end, or --sessions. `parenting access list` shows the ids.")
        with database() as db:
            for one in ids or ():
                revoke(db, one)
                say(f"Ended: {one}.")
            if sessions:
                end_all(db)
                say("All sessions are ended.")
