"""Write stored JSON in another form, row by row, on the way back to an older version."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sqlalchemy as sa
from sqlalchemy import Connection

from parenting.server.columns import UNREADABLE, loads

PIECE = 500
"""Rows that are held in memory at a time."""

Place = tuple[str, str, tuple[str, ...]]
"""A table, its column of JSON, and the columns that tell its rows apart, whole numbers."""


def rewrite(connection: Connection, place: Place, like: str, form: Callable[[Any], dict[str, Any]]) -> None:
    """Write each value whose text is `like` in another form.

    A damaged one stays as it is, for the older version to report.

    Args:
        connection: A connection in a transaction.
        place: Where the values are.
        like: The pattern of LIKE for the text of those to be rewritten.
        form: Returns the other form; it may raise what a value of another shape causes.
    """
    name, column, keys = place
    table = sa.table(name, sa.column(column, sa.JSON), *(sa.column(key, sa.BigInteger) for key in keys))
    places, stored = [table.c[key] for key in keys], sa.cast(table.c[column], sa.Text)
    wanted = sa.select(*places, stored).where(stored.like(like)).order_by(*places).limit(PIECE)
    rows = connection.execute(wanted).all()
    while rows:
        for *here, text in rows:
            found = _formed(text, form)
            if found is not None:
                row = [key == value for key, value in zip(places, here, strict=True)]
                connection.execute(table.update().where(*row).values({column: found}))
        beyond = sa.tuple_(*places) > sa.tuple_(*map(sa.literal, rows[-1][:-1]))
        rows = connection.execute(wanted.where(beyond)).all()


def _formed(text: Any, form: Callable[[Any], dict[str, Any]]) -> dict[str, Any] | None:
    """Return the other form; None where the text is not JSON or of another shape."""
    found = loads(text) if isinstance(text, str) else None
    try:
        return form(found) if isinstance(found, dict | list) else None
    except UNREADABLE:
        return None
