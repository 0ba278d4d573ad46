"""An experiment's work in pieces, each stored as soon as it is done: a kill costs the pieces in work alone.

A piece is rows of plain data, one for each trial as a rule. What a piece holds depends on its task alone, not
on who did it, when, or beside which others; seconds that it took are the one exception.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

Row = dict[str, Any]
"""Name -> number, word, truth value or null. A name that begins with HIDDEN is for other pieces alone."""
HIDDEN = "_"
PLAN, SPENT = "plan.json", "spent.json"


class Task(NamedTuple):
    """One piece of work: a function by its name, and what it is called with. Plain data, for any machine."""

    key: str  # names the piece and its file
    call: str  # "module:function"; the function takes the arguments by name and returns rows
    arguments: dict[str, Any]
    share: float = 1.0  # of the whole work, against other tasks, for the time left
    device: str = "cpu"  # where its tensors are to be
    needs: tuple[str, ...] = ()  # keys of pieces to be done before; the function takes their rows as `given`


class OtherPlan(ValueError):
    """The folder holds pieces of something else; the sentence says what differs and what to do."""


class Store:
    """The pieces of one experiment in a folder."""

    def __init__(self, folder: Path, plan: Mapping[str, Any]) -> None:
        """Open a folder, or make it. `plan` is all that pieces depend on.

        Raises:
            OtherPlan: the folder's pieces belong to another plan.
            OSError: the folder cannot be made or read.
        """
        self.folder = folder
        self._since = monotonic()
        folder.mkdir(parents=True, exist_ok=True)
        wanted = json.loads(json.dumps(plan))
        path = folder / PLAN
        if not path.exists():
            _write(path, wanted)
        _same(folder, json.loads(path.read_text(encoding="utf-8")), wanted)

    def find(self, task: Task) -> list[Row] | None:
        """A finished piece; None if it is still to be done."""
        return self.rows((task.key,)) if self.has(task.key) else None

    def rows(self, keys: Sequence[str]) -> list[Row]:
        """The rows of finished pieces.

        Raises:
            FileNotFoundError: one is not done.
        """
        return [row for key in keys for row in json.loads(self._path(key).read_text(encoding="utf-8"))]

    def has(self, key: str) -> bool:
        """Whether the piece of this key is finished."""
        return self._path(key).exists()

    def keep(self, task: Task, rows: Sequence[Row]) -> None:
        """Store a finished piece, whole or not at all."""
        _write(self._path(task.key), list(rows))
        now = monotonic()
        _write(self.folder / SPENT, self.seconds() + now - self._since)
        self._since = now

    def seconds(self) -> float:
        """How long all runs together took, each from its beginning to the last piece that it finished."""
        path = self.folder / SPENT
        return float(json.loads(path.read_text(encoding="utf-8"))) if path.exists() else 0.0

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.json"


def _write(path: Path, data: object) -> None:
    """To a name beside it first, so that a kill leaves no half of a file."""
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    beside.write_text(json.dumps(data, allow_nan=False), encoding="utf-8")
    beside.replace(path)


def _same(folder: Path, found: Mapping[str, Any], wanted: Mapping[str, Any]) -> None:
    differs = [name for name in {**found, **wanted} if found.get(name) != wanted.get(name)]
    if differs:
        said = ", ".join(f"{name} was {found.get(name)} and is {wanted.get(name)} now" for name in differs)
        raise OtherPlan(
            f"{folder} holds pieces of another plan: {said}. "
            "Name another folder by --out, or remove this one."
        )
