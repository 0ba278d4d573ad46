"""The names of runs and questions in an import, and the values of cells: rows of all tables share them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from datetime import datetime
from typing import Any, NamedTuple

from parenting.server.archive.import_rules import shown, time
from parenting.server.errors import SetupError
from parenting.server.public_ids import ALPHABET, LENGTH

REMEDY = "Nothing was imported. Take another copy of the export, or export the run again."


class Naming(NamedTuple):
    """The names of a run in the export and here."""

    number: int
    public_id: str
    was: str

    def question(self, name: str) -> str:
        """Return a question's public id here: the same one, where its run has kept its own."""
        if self.public_id == self.was:
            return name
        number = int.from_bytes(hashlib.sha256(f"{self.public_id} {name}".encode()).digest())
        return "".join(ALPHABET[number // 58**place % 58] for place in range(LENGTH))


Names = Mapping[str, Naming]


def run_of(names: Names, row: Any) -> Naming:
    """Return the names of the run that a row is of.

    Raises:
        SetupError: the manifest does not name it.
    """
    if row.run not in names:
        raise refused(row, "run", row.run, "the manifest does not name this run")
    return names[row.run]


def refused(row: Any, field: str, value: Any, said: str) -> SetupError:
    """Return the refusal of a row, with its file, its number and the field."""
    return SetupError(f"{row.place}: {shown(field, value, said)}. {REMEDY}")


def same(row: Any, *names: str) -> dict[str, Any]:
    """Return the cells that columns of the same name take as they are."""
    return {name: getattr(row, name) for name in names}


def needed(value: datetime | None) -> datetime:
    """Return a time that must be there.

    Raises:
        ValueError: it is missing.
    """
    if value is None:
        raise ValueError("a time is missing")
    return value


def time_of(text: str | None) -> datetime | None:
    """Return the time that a cell tells, in UTC."""
    return None if text is None else time(text)
