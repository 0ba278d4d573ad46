"""`parenting runs tag`: add tags to a run, or take them away."""

from __future__ import annotations

from typing import Annotated

import typer

from parenting.commands.database import database
from parenting.commands.errors import UsageError, friendly_errors
from parenting.commands.options import RunNumber
from parenting.commands.printing import say
from parenting.server.keeping import read_tag, split_tags, tag


def command(
    run: RunNumber,
    tags: Annotated[list[str] | None, typer.Argument(help="Tags to add.", show_default="none")] = None,
    remove: Annotated[
        list[str] | None, typer.Option(metavar="TAG", help="A tag to take away; may be repeated.")
    ] = None,
) -> None:
    """Add tags to a run, or take them away, and print those that it has (`parenting runs --tag`).

    Exit codes: 0 done; 2 there is no such run, or a tag cannot be stored.

    Example: parenting runs tag 3 pilot "group a" --remove draft
    """
    with friendly_errors():
        try:
            add = [read_tag(one) for one in tags or []]
        except ValueError as error:
            raise UsageError(f"TAGS: {error}.") from None
        with database() as db:
            kept = split_tags(tag(db, run, add, remove or []).tags)
    say(f"Tags of run {run}: {', '.join(kept) or 'none'}.")
