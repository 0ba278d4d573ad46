"""Overwrite what a store's files keep of rows that were deleted or changed.

SQLite leaves old rows in pages that are free and in its log. VACUUM writes the file afresh without them, and
a checkpoint that truncates the log empties it. PostgreSQL frees the space of old rows by VACUUM and uses it
again; its write-ahead log is its administrator's.
"""

from __future__ import annotations

from contextlib import closing

from sqlalchemy import Engine, text

TRIES_MS = 5000
"""A reader of an old snapshot keeps the log; it is waited for so long."""


def scrub(engine: Engine) -> bool:
    """Write a store's file afresh, without what was deleted; return whether its log is empty, too.

    No other process can write meanwhile. A SQLite file needs as much free space as it has bytes.
    """
    if engine.dialect.name != "sqlite":
        with engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
            connection.execute(text("VACUUM"))
        return True
    with closing(engine.raw_connection()) as connection:
        cursor = connection.cursor()
        cursor.execute("PRAGMA secure_delete=on").fetchall()
        cursor.execute(f"PRAGMA busy_timeout={TRIES_MS}").fetchall()
        cursor.execute("VACUUM")
        busy, _, _ = cursor.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()[0]
        cursor.execute("PRAGMA secure_delete=off").fetchall()
        return not busy
