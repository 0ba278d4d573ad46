"""The number of runs that may live at once: in all, and of those that one client has started.

A client is an address, as for connections. What it has started is remembered by the web process that took it,
and counts as long as it is not over.
"""

from __future__ import annotations

import threading

from sqlalchemy import func, select

from parenting.server.db import Database
from parenting.server.errors import TooManyRunsError
from parenting.server.statuses import LIVING
from parenting.server.tables import Run

IN_ALL = (
    "{number} runs live, and no more may: nothing was started. Stop some of them, or let whoever runs this "
    "server raise PARENTING_RUNS."
)
OF_CLIENT = (
    "{number} runs that were started from your address live, and no more may: nothing was started. Stop some "
    "of them, or let whoever runs this server raise PARENTING_RUNS_PER_CLIENT."
)


def require_room(db: Database, most: int) -> None:
    """Refuse one more run where as many live as may.

    Raises:
        TooManyRunsError: as many live.
    """
    with db.read() as session:
        living = session.scalar(select(func.count()).where(Run.status.in_(LIVING))) or 0
    if living >= most:
        raise TooManyRunsError(IN_ALL, number=living)


class StartedRuns:
    """The runs that each client of a web process has started, as far as they live."""

    def __init__(self, most: int) -> None:
        """Know of none; `most` is how many of one client may live."""
        self.most = most
        self._lock = threading.Lock()
        self._of: dict[str, set[int]] = {}

    def require_room(self, db: Database, client: str) -> None:
        """Refuse one more run of a client where as many of it live as may.

        Raises:
            TooManyRunsError: as many live.
        """
        with self._lock:
            started = set(self._of.get(client, ()))
        if len(started) < self.most:
            return
        with db.read() as session:
            living = set(session.scalars(select(Run.id).where(Run.id.in_(started), Run.status.in_(LIVING))))
        with self._lock:
            self._of[client] = self._of.get(client, set()) - (started - living)
        if len(living) >= self.most:
            raise TooManyRunsError(OF_CLIENT, number=len(living))

    def note(self, client: str, run_id: int) -> None:
        """Take note that a client has started a run."""
        with self._lock:
            self._of.setdefault(client, set()).add(run_id)
