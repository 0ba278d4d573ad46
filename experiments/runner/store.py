"""The results of an experiment's tasks, each stored at once: a kill costs only the tasks that were running.

A result is rows of plain data, as a rule one for each trial. It depends on its task alone, not on the process
that ran it, the time, or the other tasks; the seconds that it took are the one exception. A file names its
task, and the commit and versions that made it.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

from parenting.experiments.runner import provenance
from parenting.experiments.runner.aliases import before, without_later

Row = dict[str, Any]
"""Name -> number, word, truth value or null. A name that begins with HIDDEN is for other tasks alone."""
HIDDEN = "_"
PLAN, ELAPSED = "plan.json", "spent.json"
VARIANTS = "variants"
"""The part of a plan that may grow."""
OF, MADE, ROWS = "of", "made", "rows"
"""The parts of a result's file."""


class Task(NamedTuple):
    """A function by its name, and the arguments of its call. Plain data, for any machine."""

    key: str  # names the result and its file
    call: str  # "module:function"; the function takes the arguments by name and returns rows
    arguments: dict[str, Any]
    cost: float = 1.0  # relative to other tasks, for the time left
    device: str = "cpu"  # of its tensors
    needs: tuple[str, ...] = ()  # keys of tasks whose rows the function takes as `given`


Call = tuple[Task, Sequence[Row]]
"""A task, and the rows of the tasks that it needs."""
Done = tuple[Task, list[Row]]


class CorruptResultError(ValueError):
    """A stored file is not what a run writes; the sentence names it, and what to do."""


class PlanMismatchError(ValueError):
    """The folder holds results of something else; the sentence says what differs and what to do."""


class Store:
    """The task results of one experiment in a folder."""

    def __init__(self, folder: Path, plan: Mapping[str, Any], scale: str = "paper") -> None:
        """Open a folder, or make it. `plan` is all that results depend on besides their tasks.

        It may name variants that the folder's own plan has not, of which there are no results yet: they are
        added there. Time is counted for each `scale` by itself.

        Raises:
            PlanMismatchError: the folder's results belong to another plan.
            CorruptResultError: its plan cannot be read.
            OSError: the folder cannot be made or read.
        """
        self.folder, self.scale = folder, scale
        self._since = monotonic()
        self._of: dict[str, Any] = {}
        folder.mkdir(parents=True, exist_ok=True)
        wanted = without_later(_plain(plan))
        path = folder / PLAN
        if not path.exists():
            _write(path, wanted)
        found = _read(path)
        grown = _grown(found, wanted)
        _same(folder, grown, wanted)
        if grown != found:
            _write(path, grown)

    def expect(self, tasks: Sequence[Task]) -> None:
        """Name the tasks whose results are wanted.

        Raises:
            PlanMismatchError: a stored result of the same name is of another task.
            CorruptResultError: one cannot be read.
        """
        self._of, older = described(tasks), described(tasks, before)
        done = [task.key for task in tasks if self.has(task.key)]
        other = [key for key in done if self._result(key)[OF] not in (self._of[key], older[key])]
        if other:
            raise PlanMismatchError(
                f"{', '.join(other)}: these results in {self.folder} belong to other tasks. "
                "Name another folder by --out, or remove them."
            )

    def has(self, key: str) -> bool:
        """Return whether the task of this key is done."""
        return self._path(key).exists()

    def rows(self, keys: Sequence[str]) -> list[Row]:
        """Return the rows of stored results.

        Raises:
            FileNotFoundError: one is not done.
            CorruptResultError: one cannot be read.
        """
        return [row for key in keys for row in self._result(key)[ROWS]]

    def commits(self, keys: Sequence[str]) -> dict[str, int]:
        """Return how many of some results each commit made."""
        return dict(Counter(str(self._result(key)[MADE]["commit"]) for key in keys))

    def put(self, task: Task, rows: Sequence[Row]) -> None:
        """Store the result of an expected task, whole or not at all."""
        made = {"commit": provenance.commit(), **provenance.versions()}
        _write(self._path(task.key), {OF: self._of[task.key], MADE: made, ROWS: list(rows)})
        now, elapsed = monotonic(), self._elapsed()
        _write(
            self.folder / ELAPSED, {**elapsed, self.scale: elapsed.get(self.scale, 0.0) + now - self._since}
        )
        self._since = now

    def seconds(self) -> float:
        """Return the seconds of all runs of this scale, each from its beginning to its last result."""
        return self._elapsed().get(self.scale, 0.0)

    def _elapsed(self) -> dict[str, float]:
        path = self.folder / ELAPSED
        return _read(path) if path.exists() else {}

    def _result(self, key: str) -> dict[str, Any]:
        return _read(self._path(key), OF, MADE, ROWS)

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.json"


def described(tasks: Sequence[Task], words: Callable[[Any], Any] = lambda said: said) -> dict[str, Any]:
    """Describe tasks as plain data by their keys: call, arguments, device, and needed tasks.

    A needed task stands there by the digest of its description, so a change of it reaches all that need it.
    `words` translates each description, as `aliases.before` does.
    """
    by_key = {task.key: task for task in tasks}
    found: dict[str, Any] = {}

    def of(task: Task) -> Any:
        if task.key not in found:
            needs = {key: _digest(of(by_key[key])) if key in by_key else None for key in task.needs}
            said = {"call": task.call, "arguments": task.arguments, "device": task.device, "needs": needs}
            found[task.key] = words(without_later(_plain(said)))
        return found[task.key]

    for task in tasks:
        of(task)
    return found


def _digest(said: Any) -> str:
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()


def _plain(data: object) -> Any:
    """As JSON gives it back."""
    return json.loads(json.dumps(data))


def _read(path: Path, *names: str) -> dict[str, Any]:
    """A stored file, which has these names."""
    try:
        found = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict) or not found.keys() >= set(names):
        raise CorruptResultError(
            f"{path} is damaged, or of an older version. Remove it; the same command then computes it again."
        )
    return found


def _write(path: Path, data: object) -> None:
    """To a name beside it first, so that a kill leaves no half of a file."""
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    beside.write_text(json.dumps(data, allow_nan=False), encoding="utf-8")
    beside.replace(path)


def _grown(found: dict[str, Any], wanted: Mapping[str, Any]) -> dict[str, Any]:
    """A stored plan with the variants that are wanted and that it does not name."""
    if not isinstance(found.get(VARIANTS), dict):
        return found
    return {**found, VARIANTS: {**wanted.get(VARIANTS, {}), **found[VARIANTS]}}


def _same(folder: Path, found: Mapping[str, Any], wanted: Mapping[str, Any]) -> None:
    differs = min((list(_differences(found, words)) for words in (wanted, before(wanted))), key=len)
    if differs:
        raise PlanMismatchError(
            f"{folder} holds results of another plan: {', '.join(differs)}. "
            "Name another folder by --out, or remove this one."
        )


def _differences(found: Any, wanted: Any, path: str = "") -> Iterator[str]:
    """Each setting that differs, with its name from the top."""
    if isinstance(found, dict) and isinstance(wanted, dict):
        for name in {**found, **wanted}:
            yield from _differences(found.get(name), wanted.get(name), f"{path}.{name}" if path else name)
    elif found != wanted:
        yield f"{path} was {found} and is {wanted} now"
