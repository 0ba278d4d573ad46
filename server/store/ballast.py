"""The ballast: 8 MB of disk space, kept so that a database on a full disk can finish what it is doing.

Web and worker make it beside the database. The first write that finds the disk full, or the quota used up,
removes it: whoever sent that write is told that nothing was stored, and what comes next fits until somebody
has made room. A thread makes it again, once there is room for it and as much besides.
"""

from __future__ import annotations

import errno
import os
import shutil
import threading
from contextlib import suppress
from pathlib import Path

import structlog

from parenting.server.errors import DiskFullError, RefusedError, StoreError
from parenting.server.store.owner import give

log = structlog.get_logger()

BYTES = 8 * 1024 * 1024
"""64 kB would not do: the log grows by every page that is written until it can be written back."""
PROBE_BYTES = 64 * 1024
LOOK_SECONDS = 5.0
FULL = (errno.ENOSPC, errno.EDQUOT)


class Ballast:
    """The ballast of a database file. Several processes may keep the same one."""

    def __init__(self, database: Path) -> None:
        self.path = Path(f"{database}-ballast")
        self._seconds = LOOK_SECONDS
        self._closed = threading.Event()
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def make(self) -> bool:
        """Make the file, unless it is there, and return whether it is. Its blocks are really the disk's."""
        with suppress(OSError):
            if self.path.stat().st_size == BYTES:
                return True
        part = self.path.with_name(f"{self.path.name}.{os.getpid()}")
        try:
            if shutil.disk_usage(self.path.parent).free < 2 * BYTES:
                return False
            _allocate(part, BYTES)
            give(part)
            part.replace(self.path)
        except OSError:
            return False
        finally:
            with suppress(OSError):
                part.unlink(missing_ok=True)
        return True

    def keep(self) -> None:
        """Make the file now, or as soon as there is room."""
        if not self.make():
            self._watch()

    def heed(self, error: StoreError) -> None:
        """Remove the file if an error says that there is no space left, and make it again when there is."""
        if not self._no_space(error):
            return
        try:
            self.path.unlink()
        except OSError:  # none is left, or another process was first
            pass
        else:
            log.warning("disk full; the ballast was given up", ballast=str(self.path), freed=BYTES)
        self._watch()

    def close(self) -> None:
        """Stop looking for room. The file stays."""
        self._closed.set()

    def _no_space(self, error: StoreError) -> bool:
        if isinstance(error, DiskFullError):
            return True
        # SQLite says of a quota only that it could not write, so a small file has to ask again.
        return isinstance(error, RefusedError) and self._probe() in FULL

    def _probe(self) -> int | None:
        probe = self.path.with_name(f"{self.path.name}.{os.getpid()}.probe")
        try:
            _allocate(probe, PROBE_BYTES)
        except OSError as error:
            return error.errno
        finally:
            with suppress(OSError):
                probe.unlink(missing_ok=True)
        return None

    def _watch(self) -> None:
        with self._lock:
            if self._thread is None or not self._thread.is_alive():
                self._thread = threading.Thread(target=self._remake, name="ballast", daemon=True)
                self._thread.start()

    def _remake(self) -> None:
        """Look for room until there is some. A look is two system calls, and nobody waits for it."""
        while not self._closed.wait(self._seconds):
            if self.make():
                return


def _allocate(path: Path, size: int) -> None:
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o600)
    try:
        os.posix_fallocate(descriptor, 0, size)
    finally:
        os.close(descriptor)
