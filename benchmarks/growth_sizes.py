"""The bytes of each table and index of a database, on either store."""

from __future__ import annotations

import sqlite3
import tempfile
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psycopg
from sqlalchemy import text

from parenting.server.db import Database
from parenting.server.store.driver import sqlite_module

_PARTS = """
    SELECT part.relname, coalesce(owner.relname, mine.relname, part.relname), pg_relation_size(part.oid)
      FROM pg_class AS part
      LEFT JOIN pg_index ON indexrelid = part.oid
      LEFT JOIN pg_class AS mine ON mine.oid = indrelid
      LEFT JOIN pg_class AS owner ON owner.reltoastrelid = coalesce(mine.oid, part.oid)
     WHERE part.relkind IN ('r', 'i', 't') AND (part.relnamespace = 'public'::regnamespace
           OR owner.relnamespace = 'public'::regnamespace)
"""
"""Tables, indexes and what is stored beside long rows, with the table that each belongs to."""


def kept(name: str) -> bool:
    """Return whether a table or index does not grow with the answers of a run: checkpoints."""
    return "checkpoint" in name


@dataclass(frozen=True)
class Sizes:
    """Bytes by table and index: as they are, and after the store has written them without gaps."""

    now: Mapping[str, int]
    least: Mapping[str, int]

    def __sub__(self, before: Sizes) -> Sizes:
        """Return what was added since."""
        return Sizes(
            {name: size - before.now.get(name, 0) for name, size in self.now.items()},
            {name: size - before.now.get(name, 0) for name, size in self.least.items()},
        )

    def each(self, answers: int) -> dict[str, tuple[float, float]]:
        """Return megabytes in a thousand answers."""
        return {
            name: (now / 1e3 / answers, self.least.get(name, 0) / 1e3 / answers)
            for name, now in self.now.items()
        }


def sizes_of(db: Database, least: bool = False) -> Sizes:
    """Return the bytes of tables and indexes; `least` also rewrites the database, after it was measured."""
    read = _of_postgresql if db.engine.dialect.name == "postgresql" else _of_sqlite
    return Sizes(now := read(db, False), read(db, True) if least else now)


def _of_sqlite(db: Database, rewritten: bool) -> dict[str, int]:
    file = Path(str(db.engine.url.database))
    if not rewritten:
        return _pages(file)
    with tempfile.TemporaryDirectory() as folder, closing(sqlite_module().connect(file)) as store:
        store.execute("VACUUM INTO ?", [str(copy := Path(folder) / "copy.db")])
        return _pages(copy)


def _pages(file: Path) -> dict[str, int]:
    """Count pages. The SQLite that comes with Python counts them; ours is built without."""
    with closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True)) as store:
        return dict(store.execute("SELECT name, sum(pgsize) FROM dbstat GROUP BY name"))


def _of_postgresql(db: Database, rewritten: bool) -> dict[str, int]:
    with db.engine.connect() as connection:
        if rewritten:
            raw: psycopg.Connection[Any] = connection.connection.driver_connection  # type: ignore[assignment]
            raw.rollback()
            raw.autocommit = True
            raw.execute("VACUUM FULL")
            raw.autocommit = False
        found: dict[str, int] = {}
        for name, owner, size in connection.execute(text(_PARTS)):
            shown = f"{owner} (long values)" if name.startswith("pg_toast") else name
            found[shown] = found.get(shown, 0) + size
        return found
