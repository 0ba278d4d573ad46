"""The files of a database after a crash, with bits flipped in them, and what the program then says.

Files are written over in place and the log keeps its inode: the high-water mark belongs to the two of them.
"""

from __future__ import annotations

import json
import os
import random
import re
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from fastapi.testclient import TestClient
from pysqlite3 import dbapi2 as sqlite

from parenting.server.app import create_app
from parenting.server.chain import check
from parenting.server.db import Database, connect
from parenting.server.errors import ServerError, SetupError
from parenting.server.export import lines
from parenting.server.settings import Settings
from tests.faults.ledger import Told

PAGES = ("/", "/runs/{}", "/runs/{}/history", "/api/v1/runs", "/api/v1/runs/{}", "/api/v1/runs/{}/queries")
NEAR = 400
"""A flip aims at what a client was told: so many bytes around a place where its name is stored."""
REMEDIES = re.compile(r"parenting restore|[Rr]estore a backup|a backup of before the damage|docs/operations")
"""A refusal names the way to the backup."""


class Flip(NamedTuple):
    """Bits that are flipped: in the log, or else in the database file; and their places."""

    in_log: bool
    bits: tuple[int, ...]


class Crashed:
    """The database file, its log and its mark, as a SIGKILL of all processes has left them.

    A flip in the log meets the files as they are. One in the database meets a file into which the log was
    written back: before that, most of its pages are out of date.
    """

    def __init__(self, database: Path) -> None:
        self.database, self.log = database, Path(f"{database}-wal")
        self.mark, self.kept = Path(f"{database}-mark"), Path(f"{database}-kept")
        os.link(self.log, self.kept)  # so that its inode outlives SQLite's own removal
        self.before, self.logged = database.read_bytes(), self.log.read_bytes()
        self.marked = self.mark.read_bytes()
        with closing(sqlite.connect(str(database), isolation_level=None)) as connection:
            connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
        self.whole = database.read_bytes()

    def put(self, flip: Flip | None = None) -> None:
        """Write the files as they were, but for the flip."""
        in_log = flip is None or flip.in_log
        file, log = (
            bytearray(self.before if in_log else self.whole),
            bytearray(self.logged if in_log else b""),
        )
        for bit in flip.bits if flip else ():
            (log if in_log else file)[bit // 8] ^= 1 << bit % 8
        Path(f"{self.database}-shm").unlink(missing_ok=True)
        self.database.write_bytes(file)
        self.kept.write_bytes(log)
        if not self.log.exists():
            os.link(self.kept, self.log)
        self.mark.write_bytes(self.marked)

    def draw(self, rng: random.Random, told: Sequence[Told]) -> Flip:
        """Draw one bit or a few of a byte: anywhere, or near what a client was told."""
        in_log = rng.random() < 0.3
        content = self.logged if in_log else self.whole
        at = rng.randrange(len(content))
        name = re.escape(rng.choice(told).client.encode())
        places = [found.start() for found in re.finditer(name, content)][
            -len(told) :
        ]  # the last are in force
        if places and rng.random() < 0.7:
            at = max(0, min(len(content) - 1, rng.choice(places) + rng.randint(-NEAR, NEAR)))
        return Flip(in_log, tuple(8 * at + bit for bit in rng.sample(range(8), k=rng.choice((1, 1, 1, 3)))))


def said(settings: Settings, run: int, told: Sequence[Told]) -> str:
    """Open a database as it is: what the program says of it.

    Raises:
        AssertionError: it says nothing, and an answer that was told is another one or gone.
        Exception: whatever would be a traceback.
    """
    try:
        db = connect(settings)
    except SetupError as error:
        if not REMEDIES.search(error.message):
            raise AssertionError(f"no remedy: {error.message}") from error
        return "refused at the start"
    try:
        complaints = [*asked(settings, db, run), *verified(db, run)]
        if complaints:
            return "the damage is said, the rest goes on"
        exported = [json.loads(line) for line in lines(db, run)]
    finally:
        db.close()
    found = [(str(row["query"]), row["number"], row["choice"]) for row in exported]
    for one in told:
        assert found.count((one.query, one.number, one.choice)) == 1, f"nothing is said of {one}"
    return "all that was told is there"


def asked(settings: Settings, db: Database, run: int) -> list[str]:
    """The complaints of the pages. An exception that no page expects is raised here."""
    found = []
    with TestClient(create_app(settings, db), base_url="http://localhost") as client:
        for page in PAGES:
            reply = client.get(page.format(run), headers={"accept": "application/json"})
            if reply.status_code >= 400:
                assert "Traceback" not in reply.text
                found.append(f"{page}: {reply.status_code} {reply.text[:200]}")
            elif '"damaged":' in reply.text or "is damaged" in reply.text:
                found.append(f"{page}: damaged")
    return found


def verified(db: Database, run: int) -> list[str]:
    """The words of `parenting verify` on the chain of hashes."""
    try:
        return check(db, run).problems
    except ServerError as error:
        return [error.message]
