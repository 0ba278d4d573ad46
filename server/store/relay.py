"""Notifications between machines: an announcement in a transaction on PostgreSQL wakes processes everywhere.

On one machine Unix datagrams do that (`server.notify`), and on SQLite there is one machine only. Here, too, a
notification is a hint: every process polls the database as well.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
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
LISTEN_SECONDS = 0.2
"""Seconds after which a relay looks whether it is to end."""


def announce(session: Session, channel: Channel) -> None:
    """Wake the processes of a channel on every machine, once this transaction commits."""
    if session.get_bind().dialect.name == "postgresql":
        session.execute(text(f"NOTIFY parenting_{channel}"))


class Relay:
    """A thread that calls a function after each notification of a channel, of whatever machine."""

    def __init__(self, engine: Engine, channel: Channel, wake: Callable[[], None]) -> None:
        self.engine, self.channel, self.wake = engine, channel, wake
        self._told = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to listen; on SQLite there is nobody to hear."""
        if self.engine.dialect.name == "postgresql" and self._thread is None:
            self._thread = threading.Thread(target=self._run, daemon=True, name=f"relay {self.channel}")
            self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._told.set()
        if self._thread is not None:
            self._thread.join(CLOSE_SECONDS)

    def _run(self) -> None:
        while not self._told.is_set():
            try:
                with translated():
                    self._listen()
            except StoreError:  # the polls go on, or say so; this is a hint only
                self._told.wait(AGAIN_SECONDS)

    def _listen(self) -> None:
        connection = postgresql.watcher(self.engine)
        try:
            driver: Any = connection.dbapi_connection
            driver.execute(f"LISTEN parenting_{self.channel}")
            self.wake()  # what was announced before nobody heard
            while not self._told.is_set():
                for _ in driver.notifies(timeout=LISTEN_SECONDS):
                    self.wake()
        finally:
            connection.close()
