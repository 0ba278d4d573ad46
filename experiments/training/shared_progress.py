"""The progress of a run's chunks, in a small file that all of its processes map.

A tick writes three numbers there, without a lock or a message; the process that shows them reads all of them
a few times a second.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

import numpy as np

from parenting.experiments.training.counts import OnProgress, Progress, total

LOOK_SECONDS = 0.2
"""Time between two looks at the file."""
FIELDS = len(Progress._fields)


class ProgressFile:
    """The progress of each chunk, as 64-bit integers [chunks, 3] in a file."""

    def __init__(self, path: Path) -> None:
        """Map a file that `create` has made."""
        self.path = path
        self._numbers = np.memmap(path, dtype=np.int64, mode="r+").reshape(-1, FIELDS)

    @classmethod
    def create(cls, path: Path, chunks: int) -> ProgressFile:
        """Make the file, where nothing has begun."""
        path.write_bytes(bytes(8 * FIELDS * chunks))
        return cls(path)

    def write(self, place: int, now: Progress) -> None:
        """Set one chunk's progress."""
        self._numbers[place] = now

    def read(self) -> Progress:
        """Return the progress of all chunks together."""
        return total([Progress(*map(int, numbers)) for numbers in self._numbers])


@contextmanager
def watched(shared: ProgressFile | None, progress: OnProgress | None) -> Iterator[None]:
    """Call `progress` with what other processes write, a few times a second and once at the end."""
    if shared is None or progress is None:
        yield
        return
    over = Event()

    def look() -> None:
        while not over.wait(LOOK_SECONDS):
            progress(shared.read())

    thread = Thread(target=look, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
    progress(shared.read())
