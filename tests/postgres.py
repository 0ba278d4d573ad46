"""PostgreSQL for the tests: a cluster a test process, on a Unix socket, and a new database for each test.

A cluster starts in half a second, because nothing in it has to survive a crash (`fsync=off`). A database is a
copy of one that was migrated, or an earlier one that was emptied, which costs less (`tests.recycled`).
"""

from __future__ import annotations

import atexit
import glob
import os
import shutil
import subprocess
import tempfile
import time
from functools import cache
from itertools import count
from pathlib import Path
from typing import Any

import psycopg
import pytest
from sqlalchemy import URL

from tests import recycled

FAST = {
    "listen_addresses": "",
    "fsync": "off",
    "full_page_writes": "off",
    "autovacuum": "off",
    "shared_buffers": "32MB",
    "max_connections": "200",
}
USER = "parenting"
"""It owns the databases of the tests, and has no other rights."""
PATIENCE = 2.0
"""Seconds for a connection that was closed to leave the list of the server."""
# Ends with the test process, however that ends: nobody else holds the other end of its standard input.
GUARDED = """
"$0" -D "$1" -k "$1" "${@:2}" < /dev/null > "$1/log" 2>&1 &
cat > /dev/null
kill -QUIT $!
wait
rm -rf "$1"
"""
_numbers = count(1)


@cache
def programs() -> Path:
    """The folder of PostgreSQL's programs. Without one a laptop skips the test, and CI fails it."""
    named = os.environ.get("PARENTING_POSTGRES")
    found = shutil.which("postgres")
    folders = [named] if named else [str(Path(found).parent)] if found else []
    folders += sorted(glob.glob("/usr/lib/postgresql/*/bin"), reverse=True)  # Debian's are not in PATH
    if folders:
        return Path(folders[0])
    reason = "no PostgreSQL: install it (apt install postgresql) or name its bin folder in PARENTING_POSTGRES"
    if os.environ.get("CI") == "true":
        pytest.fail(reason)
    pytest.skip(reason)


class Cluster:
    """A running PostgreSQL with a socket in its own folder."""

    def __init__(self, **settings: str) -> None:
        """Make and start it; `settings` are those of postgresql.conf that differ from `FAST`."""
        self.folder = Path(tempfile.mkdtemp(prefix="parenting-pg-"))
        # PostgreSQL refuses to run as root.
        self.user = ["runuser", "-u", "postgres", "--"] if os.geteuid() == 0 else []
        if self.user:
            shutil.chown(self.folder, "postgres")
        initdb = [
            "-A",
            "trust",
            "-U",
            "postgres",
            "-E",
            "UTF8",
            "--locale=C",
            "--no-sync",
            "--no-instructions",
        ]
        self._run("initdb", *initdb)
        self.settings = FAST | settings
        self.process = self._start()
        self.admin = self._connected()
        self.lent: dict[str, recycled.Template] = {}
        self.empty: list[tuple[str, recycled.Template]] = []
        self.admin.execute(f"CREATE ROLE {USER} LOGIN")
        atexit.register(self.stop)

    def _run(self, program: str, *arguments: str) -> None:
        command = [*self.user, str(programs() / program), "-D", str(self.folder), *arguments]
        subprocess.run(command, check=True, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def _start(self) -> subprocess.Popen[bytes]:
        options = [word for name, value in self.settings.items() for word in ("-c", f"{name}={value}")]
        command = ["bash", "-c", GUARDED, str(programs() / "postgres"), str(self.folder), *options]
        # In a session of its own, so that Ctrl-C reaches the tests first and the folder is removed.
        return subprocess.Popen(
            [*self.user, *command], stdin=subprocess.PIPE, cwd=self.folder, start_new_session=True
        )

    def _connected(self, name: str = "postgres", seconds: float = 60) -> psycopg.Connection[Any]:
        end = time.monotonic() + seconds
        while True:
            try:
                return psycopg.connect(host=str(self.folder), user="postgres", dbname=name, autocommit=True)
            except psycopg.OperationalError:
                if time.monotonic() > end:
                    raise
                time.sleep(0.01)

    def stop(self) -> None:
        """Stop it at once and remove its folder."""
        self.admin.close()
        self.process.communicate()

    def new_name(self) -> str:
        """A name that no database has yet."""
        return f"test_{next(_numbers)}"

    def create(self, name: str, template: str = "template0") -> None:
        """Make a database of this name, empty or a copy of another that nobody is connected to."""
        # The files are copied: four times as fast as through the log, where nothing is synced anyway.
        self.admin.execute(f"CREATE DATABASE {name} OWNER {USER} TEMPLATE {template} STRATEGY file_copy")

    def copy(self, name: str, template: str) -> None:
        """Make a database that is as the template, which only this method copies."""
        if self.empty:
            before, self.lent[name] = self.empty.pop()
            self.admin.execute(f"ALTER DATABASE {before} RENAME TO {name}")
            return
        if template not in self.lent:
            with self._connected(template) as connection:
                self.lent[template] = recycled.template(connection)
        self.create(name, template)
        self.lent[name] = self.lent[template]

    def drop(self, name: str) -> None:
        """Remove a database, if it was made, and the connections to it; or keep it for another test."""
        if name not in self.lent or not self._emptied(name, self.lent.pop(name)):
            self.admin.execute(f"DROP DATABASE IF EXISTS {name} WITH (FORCE)")

    def _emptied(self, name: str, template: recycled.Template) -> bool:
        others = "SELECT pg_terminate_backend(pid, 5000) FROM pg_stat_activity WHERE datname = %s"
        self.admin.execute(others, [name])
        try:
            with self._connected(name, seconds=0) as connection:
                empty = recycled.empty(connection, template)
        except psycopg.OperationalError:  # the test has removed it, or lets nobody in
            return False
        end = time.monotonic() + PATIENCE
        while self.admin.execute(others.replace("pg_terminate_backend(pid, 5000)", "1"), [name]).fetchone():
            if time.monotonic() > end:  # not ours, which has been closed: a thread of the test has come back
                return False
            time.sleep(0.001)
        self.empty += [(name, template)] * empty
        return empty

    def url(self, name: str) -> str:
        """The URL of a database, for `PARENTING_DATABASE_URL`."""
        where = URL.create("postgresql", USER, database=name, query={"host": str(self.folder)})
        return where.render_as_string()


@cache
def cluster() -> Cluster:
    """The cluster of this test process."""
    programs()
    return Cluster()
