"""Bells: a unix datagram after a commit wakes the process at the other end. A hint; the truth is a poll.

Everyone who waits for a bell binds a socket of his own in the data folder; whoever rings sends one byte to
each of them. Nothing is queued: a bell that rang ten times woke once. Lost hints cost one poll, never an
answer.
"""

from __future__ import annotations

import hashlib
import os
import secrets
import select
import socket
import tempfile
from pathlib import Path

LONGEST = 100
"""Bytes in the path of a unix socket (the system's limit is 104 to 108)."""


class Bell:
    """One bell of a data folder: `worker` rings after answers and events, `web` after questions."""

    def __init__(self, data: Path, name: str) -> None:
        self.folder = _folder(data, name)
        self._ear: socket.socket | None = None
        self._path: Path | None = None

    def ring(self) -> None:
        """Wake all who wait. Never blocks and never fails; a socket that nobody holds any more is removed."""
        try:
            paths = list(self.folder.iterdir())
        except OSError:
            return  # nobody has listened yet
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as out:
            out.setblocking(False)
            for path in paths:
                try:
                    out.sendto(b"!", str(path))
                except (ConnectionRefusedError, FileNotFoundError):
                    path.unlink(missing_ok=True)
                except OSError:
                    continue  # full: it will wake anyway

    def wait(self, timeout: float) -> bool:
        """Wait until the bell rings, at most `timeout` seconds; whether it rang.

        Hears what rang since the last call.
        """
        ear = self.listen()
        if not select.select([ear], [], [], max(timeout, 0))[0]:
            return False
        self.drain()
        return True

    def listen(self) -> socket.socket:
        """The socket on which this bell is heard, bound at the first call; for an event loop to watch."""
        if self._ear is None:
            self.folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            # A name of its own, and no process id: containers that share the folder have equal ones.
            self._path = self.folder / secrets.token_hex(8)
            self._ear = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            self._ear.setblocking(False)
            self._ear.bind(str(self._path))
        return self._ear

    def drain(self) -> None:
        """Forget every ring so far."""
        ear = self.listen()
        try:
            while ear.recv(16):
                pass
        except BlockingIOError:
            return

    def close(self) -> None:
        """Stop listening."""
        if self._ear is not None and self._path is not None:
            self._ear.close()
            self._path.unlink(missing_ok=True)
            self._ear = self._path = None


def _folder(data: Path, name: str) -> Path:
    """In the data folder, or in the system's temporary one where the path would be too long for a socket."""
    folder = data.absolute() / "bells" / name
    if len(os.fsencode(folder)) + 20 <= LONGEST:
        return folder
    digest = hashlib.sha256(os.fsencode(data.absolute())).hexdigest()[:16]
    return Path(tempfile.gettempdir()) / f"parenting-{os.getuid()}-{digest}" / name
