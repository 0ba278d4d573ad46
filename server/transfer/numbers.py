"""Numbers that are never given twice: PostgreSQL's sequences, and the largest deleted numbers of SQLite.

Both say from where on rows are numbered. SQLite keeps the largest deleted run and question (`identity`); of
other tables it numbers on from the largest row that is there.
"""

from __future__ import annotations

from collections.abc import Mapping

from sqlalchemy import Connection, Table, func, select, text, update

from parenting.server.tables import Identity, Query, Run
from parenting.server.tables import Table as Root

KEPT = {Run.__tablename__: "last_run", Query.__tablename__: "last_query"}
"""The tables whose deleted numbers SQLite keeps, and the columns that keep them."""


def given(connection: Connection) -> dict[str, int]:
    """Return the largest number that each table has given to a row that may be deleted by now."""
    if connection.dialect.name == "sqlite":
        columns = [Identity.last_run, Identity.last_query]
        kept = connection.execute(select(*columns)).one()
        return dict(zip(KEPT, kept, strict=True))
    return {name: _last(connection, counter) for name, counter in _counters(connection).items()}


def go_on_from(connection: Connection, numbers: Mapping[str, int]) -> None:
    """Have a filled database number new rows after all that were ever given, as far as its store can."""
    largest = {name: _largest(connection, name) for name in _numbered()}
    if connection.dialect.name == "sqlite":
        over = {KEPT[name]: numbers[name] for name in KEPT if numbers.get(name, 0) > largest[name]}
        if over:
            connection.execute(update(Identity).values(over))
        return
    for name, counter in _counters(connection).items():
        number = max(numbers.get(name, 0), largest[name])
        asked = {"counter": counter, "number": max(number, 1), "called": number > 0}
        connection.execute(text("SELECT setval(CAST(:counter AS regclass), :number, :called)"), asked)


def _numbered() -> dict[str, Table]:
    tables = Root.metadata.tables
    return {name: table for name, table in tables.items() if table.autoincrement_column is not None}


def _largest(connection: Connection, name: str) -> int:
    number: int | None = connection.execute(select(func.max(_numbered()[name].c.id))).scalar_one()
    return number or 0


def _counters(connection: Connection) -> dict[str, str]:
    """Return the sequence of each table that has one."""
    found = {
        name: connection.execute(
            text("SELECT pg_get_serial_sequence(:name, 'id')"), {"name": f'"{name}"'}
        ).scalar_one()
        for name in _numbered()
    }
    return {name: counter for name, counter in found.items() if counter is not None}


def _last(connection: Connection, counter: str) -> int:
    last, called = connection.execute(text(f"SELECT last_value, is_called FROM {counter}")).one()
    return int(last) if called else 0
