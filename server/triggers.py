"""Triggers by which SQLite gives a deleted row's number to no other row."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, MetaData

KEPT = ("run", "query")
"""The tables whose deleted numbers are kept."""


def keep_deleted_numbers(_target: MetaData, connection: Connection, **_more: Any) -> None:
    """Have the identity of a SQLite database keep the largest deleted number of some tables."""
    if connection.dialect.name != "sqlite":
        return
    for table in KEPT:
        connection.exec_driver_sql(
            f"CREATE TRIGGER keep_deleted_{table} AFTER DELETE ON {table} BEGIN UPDATE database_identity "
            f"SET last_{table} = OLD.id WHERE last_{table} < OLD.id; END"
        )
