"""Notifications between processes: a Unix datagram after a commit wakes the process at the other end.

Each process that waits binds a socket of its own in the data folder; a notification sends a word to each
socket: the number of the run that has news, or a mark where it is not one run. Ten notifications wake a
listener once. A notification is only a hint. Every listener polls the database as well, so a lost one costs
one poll and never an answer.
"""

from __future__ import annotations

import hashlib
import os
import secrets
import select
import socket
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from parenting.server.store.owner import give

MAX_PATH_BYTES = 100
"""The longest path of a Unix socket that we use; the operating systems allow 104 to 108 bytes."""


SOCKETS = "sockets"
"""The folder of all channels in a data folder."""
FULL = 10
"""Notifications after which others may have been lost: Linux lets so few wait at a socket."""


class News(NamedTuple):
    """The news that notifications have told."""

    runs: frozenset[int]  # that have news
    others: bool  # something else may have, too


class Notifier:
    """One channel of a data folder.

    The channel `worker` is notified after answers and operator events, `web` after questions.
    """

    def __init__(self, data: Path, channel: str) -> None:
        self.folder = _folder(data, channel)
        self._listener: socket.socket | None = None
        self._path: Path | None = None

    def notify(self, run: int | None = None) -> None:
        """Wake every listener, and tell it which run has news, if it is one.

        Never blocks and never fails; removes sockets that no process holds.
        """
        try:
            paths = list(self.folder.iterdir())
        except OSError:
            return  # nobody has listened yet
        for path in paths:
            _send(path, "" if run is None else str(run))

    def wake(self, run: str = "") -> None:
        """Wake this process's own `wait`, from another thread. Never blocks and never fails.

        Args:
            run: The number of the run that has news; anything else says that others have.
        """
        if self._path is not None:
            _send(self._path, run)

    def listeners(self) -> int:
        """Return the number of processes that listen, those that were stopped by a signal included."""
        try:
            paths = list(self.folder.iterdir())
        except OSError:
            return 0
        return sum(_held(path) for path in paths)

    def wait(self, timeout: float) -> bool:
        """Wait for a notification, at most `timeout` seconds; return False when none came.

        A notification sent since the last call counts.
        """
        try:
            listener = self.listen()
        except OSError:  # a folder that cannot be written for a while: whoever polls goes on
            time.sleep(max(timeout, 0))
            return False
        if not select.select([listener], [], [], max(timeout, 0))[0]:
            return False
        self.drain()
        return True

    def listen(self) -> socket.socket:
        """Return the socket that receives notifications, bound at the first call; for an event loop.

        Raises:
            OSError: no socket can be made in the folder.
        """
        if self._listener is None:
            # A random name instead of the process id: containers that share the folder have equal ids.
            path = self.folder / secrets.token_hex(8)
            self._listener, self._path = _bound(path), path
        return self._listener

    def drain(self) -> News:
        """Take every notification received so far, and return what they told."""
        listener, words = self.listen(), list[bytes]()
        with suppress(BlockingIOError):
            while word := listener.recv(32):
                words.append(word)
        named = [int(word) for word in words if word.isdigit()]
        return News(frozenset(named), len(named) < len(words) or len(words) >= FULL)

    def close(self) -> None:
        """Stop listening and remove the socket; with the last one, its folder in the temporary folder."""
        if self._listener is not None and self._path is not None:
            self._listener.close()
            with suppress(OSError):
                self._path.unlink()
                _tidy(self.folder)
            self._listener = self._path = None


def _bound(path: Path, tries: int = 3) -> socket.socket:
    """A socket bound to this path, whose folder another process may remove before it is bound."""
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        listener.setblocking(False)
        listener.bind(str(path))
        give(path.parent.parent, path.parent, path)
    except OSError as error:
        listener.close()
        if isinstance(error, FileNotFoundError) and tries > 1:
            return _bound(path, tries - 1)
        raise
    return listener


def _held(path: Path) -> bool:
    """Return whether a process holds the socket of this path."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as out:
        try:
            out.connect(str(path))
        except OSError:
            return False
    return True


def _send(path: Path, word: str) -> None:
    """Send a word to a socket; one that no process holds is removed."""
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as out:
        out.setblocking(False)
        try:
            out.sendto(word.encode() or b"!", str(path))
        except (ConnectionRefusedError, FileNotFoundError):
            path.unlink(missing_ok=True)
        # any other error: its buffer is full, so that it wakes anyway; or the folder cannot be written


def _tidy(folder: Path) -> None:
    """Remove a channel's folder from the temporary folder, if it is there and empty.

    Raises:
        OSError: another process listens there.
    """
    if folder.parent.name != SOCKETS:
        folder.rmdir()
        folder.parent.rmdir()


def _folder(data: Path, channel: str) -> Path:
    """Return a folder below the data folder, or below the temporary one where a path would be too long."""
    folder = data.absolute() / SOCKETS / channel
    if len(os.fsencode(folder)) + 20 <= MAX_PATH_BYTES:
        return folder
    digest = hashlib.sha256(os.fsencode(data.absolute())).hexdigest()[:16]
    return Path(tempfile.gettempdir()) / f"parenting-{os.getuid()}-{digest}" / channel
