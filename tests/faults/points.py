"""Named points at which a process kills itself, and the mark that says where it was when somebody else did.

A point is a statement or the commit of a transaction that wrote something, before or after it: *after the
commit of an answer* is the place between the commit and the reply. The n-th passage kills.
"""

from __future__ import annotations

import mmap
import os
import re
import signal
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from tests.faults import tap
from tests.faults.tap import COMMIT, Moment

MARK_BYTES = 128


class Point(NamedTuple):
    """A place by name: `when` a statement passes by, or the commit of the transaction that it is in."""

    name: str
    when: str  # before, after
    pattern: str  # of the statement
    commit: bool = False  # the commit of the transaction that it is in, instead of itself
    seldom: bool = False  # a process may pass it but once
    first: bool = False  # a process passes it at its start, before it works
    passage: int = 1  # which passage kills
    signal: signal.Signals = signal.SIGKILL

    def fits(self, moment: Moment) -> bool:
        """Return whether a moment is this point."""
        if moment.when != self.when or self.commit != (moment.act == COMMIT):
            return False
        return any(re.search(self.pattern, one) for one in (moment.writes if self.commit else (moment.act,)))


class Trigger:
    """Kills this process at a point. Passages count from when the file `gate` is there, if one is named."""

    def __init__(self, point: Point, gate: Path | None = None) -> None:
        self.point, self.gate, self.passed = point, gate, 0

    def __call__(self, moment: Moment) -> None:
        if self.point.fits(moment) and (self.gate is None or self.gate.exists()):
            self.passed += 1
            if self.passed == self.point.passage:
                os.kill(os.getpid(), self.point.signal)


def place_of(moment: Moment) -> str:
    """The place of a moment that no point names: before or after a kind of statement."""
    return f"{moment.when} {moment.act.split()[0].upper()}"


class Mark:
    """The last point that this process passed, in a file that outlives it."""

    def __init__(self, file: Path, points: Sequence[Point]) -> None:
        file.write_bytes(b" " * MARK_BYTES)
        self.points = points
        with file.open("r+b") as opened:
            self.memory = mmap.mmap(opened.fileno(), MARK_BYTES)

    def __call__(self, moment: Moment) -> None:
        name = next((point.name for point in self.points if point.fits(moment)), None)
        if name is None:
            name = place_of(moment)
        self.memory[:] = name.encode().ljust(MARK_BYTES)


def arm(mark: str, point: Point | None, points: Sequence[Point], gate: Path | None = None) -> None:
    """In a process that was just started: note where it is, and kill it at the point, if there is one.

    With a `gate` it lives on until that file is there.
    """
    tap.listen(Mark(Path(mark), points))
    if point is not None:
        tap.listen(Trigger(point, gate))


def marked(file: Path) -> str:
    """The last point that a process passed, or that it had touched no database yet."""
    return file.read_bytes().decode().strip() or "before the first statement"


def around(name: str, pattern: str, seldom: bool = False, first: bool = False) -> list[Point]:
    """The four points of a write: before and after the statement, before and after its commit."""
    return [
        Point(f"before {name}", "before", pattern, False, seldom, first),
        Point(f"after {name}, before its commit", "after", pattern, False, seldom, first),
        Point(f"at the commit of {name}", "before", pattern, True, seldom, first),
        Point(f"after the commit of {name}", "after", pattern, True, seldom, first),
    ]


WEB = [
    *around("an answer", r"INSERT INTO answer"),
    *around("a lease", r'UPDATE "?query"? SET .*leased_by'),
    *around("an operator's event", r"INSERT INTO event"),
    *around("a pause", r"UPDATE run SET .*status"),
]
GROUP = [
    Point("after the savepoint of a request", "after", r"SAVEPOINT request"),
    Point("before the end of a savepoint", "before", r"RELEASE request"),
    Point("between the savepoints and the commit of a group", "after", r"RELEASE request"),
    Point("at the commit of a group's answer", "before", r"INSERT INTO answer", commit=True),
    Point("between the commit of a group and its replies", "after", r"INSERT INTO answer", commit=True),
]
"""Points of the thread that stores what waits together (`server.group_commit`), on SQLite."""
WORKER = [
    *around("a question", r'INSERT INTO "?query"?'),
    *around("an answer's tick", r"UPDATE answer SET .*applied_tick"),
    *around("an event's tick", r"UPDATE event SET .*applied_tick", seldom=True),
    *around("a part of a checkpoint", r"INSERT INTO checkpoint_part\b"),
    *around("a checkpoint", r"INSERT INTO checkpoint\b"),
    *around("old checkpoints' end", r"DELETE FROM checkpoint\b"),
    *around("an old part's end", r"DELETE FROM checkpoint_part\b"),
    *around("a claim", r"UPDATE run SET .*fencing_token=", seldom=True, first=True),
    *around("a sign of life", r"UPDATE (run|worker) SET .*heartbeat="),
    *around("metrics", r"INSERT INTO metric"),
]
CLOSING = [
    *around("letting go of runs", r"UPDATE run SET worker=[^,]*, heartbeat="),
    *around("signing off", r"DELETE FROM worker WHERE worker.name"),
]
