"""Notifications between machines: an announcement in a transaction on PostgreSQL wakes processes everywhere.

On one machine Unix datagrams do that (`server.notify`), and on SQLite there is one machine only. Here, too, a
notification is a hint: every process polls the database as well.
"""

from __future__ import annotations

import select
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Literal

from sqlalchemy import Engine, text
from sqlalchemy.orm import Session

from parenting.server.errors import StoreError
from parenting.server.store import postgresql
from parenting.server.store.refusals import translated

Channel = Literal["worker", "web"]
AGAIN_SECONDS = 1.0
"""Seconds until a connection that was lost is made again."""
CLOSE_SECONDS = 1.0
"""Seconds that an end waits for a relay; one that cannot reach the server ends with its process."""


def announce(session: Session, channel: Channel, run: int | None = None) -> None:
    """Wake the processes of a channel on every machine, once this transaction commits.

    It tells them which run has news, if it is one.
    """
    if session.get_bind().dialect.name == "postgresql":
        told = {"channel": f"parenting_{channel}", "word": "" if run is None else str(run)}
        session.execute(text("SELECT pg_notify(:channel, :word)"), told)


class Relay:
    """A thread that calls a function after each notification of a channel, of whatever machine.

    It receives the number of the run that has news, and nothing where others may have.
    """

    def __init__(self, engine: Engine, channel: Channel, wake: Callable[[str], None]) -> None:
        self.engine, self.channel, self.wake = engine, channel, wake
        self._told = threading.Event()
        self._thread: threading.Thread | None = None
        self._bell: socket.socket | None = None  # a byte from it ends the wait for notifications

    def start(self) -> None:
        """Begin to listen; on SQLite there is nobody to hear."""
        if self.engine.dialect.name == "postgresql" and self._thread is None:
            self._bell, ear = socket.socketpair()
            name = f"relay {self.channel}"
            self._thread = threading.Thread(target=self._run, args=(ear,), daemon=True, name=name)
            self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._told.set()
        if self._thread is not None and self._bell is not None:
            with suppress(OSError):  # it has ended
                self._bell.send(b"!")
            self._thread.join(CLOSE_SECONDS)
            self._bell.close()

    def _run(self, ear: socket.socket) -> None:
        with ear:
            while not self._told.is_set():
                try:
                    with translated():
                        self._listen(ear)
                except StoreError:  # the polls go on, or say so; this is a hint only
                    self._told.wait(AGAIN_SECONDS)

    def _listen(self, ear: socket.socket) -> None:
        """Sleep until the server sends something, or the bell rings: nothing wakes this thread besides."""
        connection = postgresql.watcher(self.engine)
        try:
            driver: Any = connection.dbapi_connection
            driver.execute(f"LISTEN parenting_{self.channel}")
            self.wake("")  # what was announced before nobody heard
            while not self._told.is_set():
                select.select([driver, ear], [], [])
                for told in driver.notifies(timeout=0):
                    self.wake(told.payload)
        finally:
            connection.close()
