"""PostgreSQL databases that are used again: emptied in a tenth of the time that a new copy takes.

A database whose tables, settings or rights were changed is no longer the template's, and is not used again.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple

import psycopg
from psycopg import sql

# What was defined since the template was copied has another `xmin`. Emptying a table changes its files alone.
DEFINED = """
SELECT md5(string_agg(part, ' ' ORDER BY part)) FROM (
  SELECT concat_ws(' ', 'column', attrelid, attnum, xmin) FROM pg_attribute WHERE attrelid >= 16384
  UNION ALL SELECT concat_ws(' ', 'table', oid, relname, relkind, relacl) FROM pg_class WHERE oid >= 16384
  UNION ALL SELECT concat_ws(' ', 'constraint', oid, xmin) FROM pg_constraint WHERE oid >= 16384
  UNION ALL SELECT concat_ws(' ', 'trigger', oid, xmin) FROM pg_trigger WHERE oid >= 16384
  UNION ALL SELECT concat_ws(' ', 'index', indexrelid, xmin) FROM pg_index WHERE indexrelid >= 16384
  UNION ALL SELECT concat_ws(' ', 'function', oid, xmin) FROM pg_proc WHERE oid >= 16384
  UNION ALL SELECT concat_ws(' ', 'schema', nspname, nspacl) FROM pg_namespace WHERE nspname !~ '^pg_'
  UNION ALL SELECT concat_ws(' ', 'database', datallowconn, datconnlimit, datacl)
    FROM pg_database WHERE datname = current_database()
  UNION ALL SELECT concat_ws(' ', 'setting', setrole, setconfig) FROM pg_db_role_setting
  UNION ALL SELECT concat_ws(' ', 'prepared', gid) FROM pg_prepared_xacts
) parts(part)
"""
TABLES = "SELECT relname FROM pg_class WHERE relkind = 'r' AND relnamespace = 'public'::regnamespace"
FILLED = f"{TABLES} AND pg_relation_size(oid) > 0"
SEQUENCES = """
SELECT format('SELECT setval(%L, 1, false)', oid::regclass) FROM pg_class
WHERE relkind = 'S' AND relnamespace = 'public'::regnamespace
"""


class Template(NamedTuple):
    """A migrated database: the digest of what is defined in it, and its rows as JSON, by table."""

    defined: str
    rows: dict[str, str]


def template(connection: psycopg.Connection[Any]) -> Template:
    """Read the template of all others."""
    rows = {table: _rows(connection, table) for table in _names(connection, TABLES)}
    return Template(_defined(connection), {name: found for name, found in rows.items() if json.loads(found)})


def empty(connection: psycopg.Connection[Any], template: Template) -> bool:
    """Give a database the template's rows again; return False where more than rows was changed."""
    if _defined(connection) != template.defined:
        return False
    if filled := _names(connection, FILLED):
        tables = sql.SQL(", ").join(map(sql.Identifier, filled))
        connection.execute(sql.SQL("TRUNCATE {} CASCADE").format(tables))
    for statement in _names(connection, SEQUENCES):
        connection.execute(statement)
    for table, rows in template.rows.items():
        name = sql.Identifier(table)
        fill = "INSERT INTO {} SELECT * FROM json_populate_recordset(NULL::{}, %s)"
        connection.execute(sql.SQL(fill).format(name, name), [rows])
    return True


def _defined(connection: psycopg.Connection[Any]) -> str:
    (found,) = connection.execute(DEFINED).fetchone() or ("",)
    return str(found)


def _names(connection: psycopg.Connection[Any], query: str) -> list[str]:
    return [name for (name,) in connection.execute(query).fetchall()]


def _rows(connection: psycopg.Connection[Any], table: str) -> str:
    query = sql.SQL("SELECT coalesce(json_agg(found), '[]')::text FROM {} found").format(
        sql.Identifier(table)
    )
    (rows,) = connection.execute(query).fetchone() or ("[]",)
    return str(rows)
