"""The ledger: the promises that clients were given, written down once a reply was read to its end.

A line is on the disk before the client goes on, so a client that is killed leaves no promise unwritten but
the one in hand. The auditor (tests/faults/auditor.py) holds the database to it.
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple


class Told(NamedTuple):
    """A reply of 2xx to an answer."""

    query: str  # its number or its public id, as the reply names it
    run: str
    number: int
    choice: str
    client: str


class Offer(NamedTuple):
    """A question in a client's hands, from the moment that it was asked for to the end of its lease.

    The client's own clock: monotonic, and the same for all processes of a machine.
    """

    query: str
    client: str
    since: float
    until: float


class Ledger:
    """A file of JSON lines; each client has its own, or threads share one."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self._turn = threading.Lock()
        self._descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)

    def told(self, receipt: dict[str, Any], client: str) -> None:
        """Write down the receipt of an answer."""
        names = (str(receipt["query"]), str(receipt["run"]))
        self._write("told", Told(*names, receipt["number"], receipt["choice"], client))

    def offered(self, offer: Offer) -> None:
        """Write down that a question was leased and is in hand."""
        self._write("offer", offer)

    def _write(self, kind: str, row: NamedTuple) -> None:
        line = json.dumps([kind, *row]).encode() + b"\n"
        with self._turn:
            assert os.write(self._descriptor, line) == len(line)
            os.fdatasync(self._descriptor)

    def close(self) -> None:
        """Close the file."""
        os.close(self._descriptor)


class Entries(NamedTuple):
    """The content of ledgers."""

    told: list[Told]
    offers: list[Offer]


def read(*files: Path) -> Entries:
    """The lines of these ledgers. A line that was cut by a kill promised nothing."""
    return told_in(*(file.read_bytes() for file in files))


def told_in(*contents: bytes) -> Entries:
    """The same for the contents of files."""
    rows = [row for content in contents for row in _rows(content)]
    return Entries(
        [Told(*row[1:]) for row in rows if row[0] == "told"],
        [Offer(*row[1:]) for row in rows if row[0] == "offer"],
    )


def _rows(data: bytes) -> Iterator[Any]:
    whole, _, _cut = data.rpartition(b"\n")
    yield from map(json.loads, whole.splitlines())
