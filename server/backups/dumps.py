"""Dumps of a PostgreSQL database by PostgreSQL's own tools, which know every version's details.

The tools get the connection by environment variables: a password among a program's arguments is seen by
everybody on the machine.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from sqlalchemy import URL

from parenting.server.backups.copies import TABLES
from parenting.server.errors import SetupError

OPTIONS = {"sslmode": "PGSSLMODE", "sslrootcert": "PGSSLROOTCERT", "host": "PGHOST", "port": "PGPORT"}
"""Options of a URL that the tools take, and their variables."""


def dump(url: URL, target: Path) -> int:
    """Write a dump in PostgreSQL's custom format, read its list, and return the number of tables with data.

    It is one snapshot: pages and worker go on meanwhile.

    Raises:
        SetupError: pg_dump is missing or fails; the sentence has the command.
    """
    _run(url, "pg_dump", "--format=custom", "--no-owner", "--no-privileges", f"--file={target}")
    return check(target)


def check(file: Path) -> int:
    """Read the list of a dump, and return the number of tables whose data it has.

    Raises:
        SetupError: it is not a dump, is cut off, or lacks a table of ours.
    """
    listed = _run(None, "pg_restore", "--list", str(file)).splitlines()
    tables = {line.split()[6] for line in listed if " TABLE DATA " in line and len(line.split()) > 6}
    missing = [name for name in (*TABLES, "alembic_version") if name not in tables]
    if missing:
        raise SetupError(f"{file} has no data of: {', '.join(missing)}. Use another backup.")
    return len(tables)


def restore(url: URL, file: Path) -> None:
    """Put the tables of a dump in place of those of the database, all or nothing.

    Raises:
        SetupError: pg_restore is missing or fails.
    """
    arguments = ["--clean", "--if-exists", "--no-owner", "--no-privileges", "--single-transaction"]
    _run(url, "pg_restore", *arguments, f"--dbname={url.database}", str(file))


def environment(url: URL) -> dict[str, str]:
    """Return a URL as the environment variables of PostgreSQL's tools."""
    named = {
        "PGHOST": url.host,
        "PGPORT": None if url.port is None else str(url.port),
        "PGUSER": url.username,
        "PGPASSWORD": url.password,
        "PGDATABASE": url.database,
    }
    named |= {OPTIONS[name]: str(value) for name, value in url.query.items() if name in OPTIONS}
    return {name: str(value) for name, value in named.items() if value is not None}


def _run(url: URL | None, tool: str, *arguments: str) -> str:
    said = _command(tool, arguments, url)
    if shutil.which(tool) is None:
        raise SetupError(
            f"{tool} is not installed here (Debian: apt install postgresql-client). Install it, or run this "
            f"where it is: {said}"
        )
    more = {} if url is None else environment(url)
    done = subprocess.run(
        [tool, *arguments],
        env={**os.environ, **more},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        raise SetupError(f"{tool} failed: {_reason(done.stderr)}. The command was: {said}")
    return done.stdout


def _reason(told: str) -> str:
    """Return the line of a tool that says why it failed; warnings, and what it was at, may come before."""
    lines = told.strip().splitlines() or ["it said nothing"]
    return next((line for line in lines if ": error: " in line), lines[0])


def _command(tool: str, arguments: Sequence[str], url: URL | None) -> str:
    """Return a command line to copy, without a password."""
    shown = {} if url is None else {k: v for k, v in environment(url).items() if k != "PGPASSWORD"}
    return " ".join([*(f"{name}={value}" for name, value in shown.items()), tool, *arguments])
