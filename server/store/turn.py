"""A turn to write between the processes of one machine, so that none of them starves.

SQLite lets a process that finds the file locked sleep for up to a tenth of a second before it tries again.
One that writes all the time leaves it free for microseconds, so the others wait for seconds, and in the end
are told that the store is busy. Here whoever writes first locks the folder of the database, and tries again
every half of a millisecond. Who has just had the turn lets those who wait go first.

The turn is a courtesy: SQLite's own lock decides. A process that cannot lock the folder, or does not get its
turn soon, goes on without it, and its locks end with it.
"""

from __future__ import annotations

import fcntl
import os
import time
from contextlib import suppress
from pathlib import Path

from parenting.server.store.patience import remaining

MOST_SECONDS = 0.25
"""Seconds that anybody waits for a turn: its holder may be stopped, and then only SQLite knows more."""
AGAIN_SECONDS = 0.0005
"""Seconds between two tries."""
POLITE_SECONDS = 0.002
"""Seconds since its last turn in which a process lets others go first, if any wait."""
WAITING = "sockets"
"""The folder beside the database (`server.notify`) that whoever waits has locked, shared with others."""


class Turn:
    """The turn to write to the databases of one folder, for one thread of this process at a time."""

    def __init__(self, folder: Path | None) -> None:
        """Wait for nobody yet; without a folder there is nobody to wait for."""
        self._turn = Lock(folder)
        self._waiting = Lock(None if folder is None else folder / WAITING)
        self._gave = float("-inf")  # when it was given back last

    def take(self) -> bool:
        """Wait for the turn, for a bounded time, and return whether it is held now."""
        if self._turn.folder is None:
            return False
        until = time.monotonic() + remaining(MOST_SECONDS)
        polite = min(self._gave + POLITE_SECONDS, until)
        while time.monotonic() < polite and self._others_wait():
            time.sleep(AGAIN_SECONDS)
        if self._turn.locked(fcntl.LOCK_EX):
            return True
        try:
            while self._turn.is_open and time.monotonic() < until:
                self._waiting.locked(fcntl.LOCK_SH)
                time.sleep(AGAIN_SECONDS)
                if self._turn.locked(fcntl.LOCK_EX):
                    return True
            return False
        finally:
            self._waiting.unlock()

    def give_back(self) -> None:
        """Let others have the turn, if it is held."""
        self._turn.unlock()
        self._gave = time.monotonic()

    def close(self) -> None:
        """Close the folders, which gives the turn back."""
        self._turn.close()
        self._waiting.close()

    def _others_wait(self) -> bool:
        """Return whether a process has locked the folder of those who wait."""
        free = self._waiting.locked(fcntl.LOCK_EX)
        self._waiting.unlock()
        return not free and self._waiting.is_open


class Lock:
    """A lock of a folder, which nobody waits for."""

    def __init__(self, folder: Path | None) -> None:
        self.folder = folder
        self._open: int | None = None

    @property
    def is_open(self) -> bool:
        """Return whether the folder is there and can be locked."""
        return self._open is not None

    def locked(self, how: int) -> bool:
        """Lock it, shared or alone, and return whether that was possible."""
        try:
            if self._open is None:
                self._open = os.open(self.folder or "", os.O_RDONLY | os.O_CLOEXEC)
            fcntl.flock(self._open, how | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:  # a file system without such locks, or a folder that is not there now
            self.close()
            return False
        return True

    def unlock(self) -> None:
        """Unlock it, if it is locked."""
        if self._open is not None:
            with suppress(OSError):
                fcntl.flock(self._open, fcntl.LOCK_UN)

    def close(self) -> None:
        """Close the folder, which unlocks it."""
        if self._open is not None:
            os.close(self._open)
            self._open = None
