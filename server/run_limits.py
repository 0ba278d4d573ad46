"""The number of runs that may live at once: in all, and of those that one client has started.

A client is an address, as for connections. What it has started is remembered by the web process that took it,
and counts as long as it is not over.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from parenting.server.db import Database
from parenting.server.errors import TooManyRunsError
from parenting.server.statuses import LIVING
from parenting.server.tables import Identity, Run

IN_ALL = (
    "{number} runs live, and no more may: nothing was started. Stop some of them, or let whoever runs this "
    "server raise PARENTING_RUNS."
)
OF_CLIENT = (
    "{number} runs that were started from your address live, and no more may: nothing was started. Stop some "
    "of them, or let whoever runs this server raise PARENTING_RUNS_PER_CLIENT."
)


def require_room(session: Session, most: int) -> None:
    """Refuse one more run where as many live as may, in the transaction that adds it.

    Those who add runs within a limit do it one after another: SQLite has one writer, and on PostgreSQL they
    lock the only row of the database's identity. So no two take the last place.

    Raises:
        TooManyRunsError: as many live.
    """
    session.execute(select(Identity.id).with_for_update()).all()
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
        self._beginning = Counter[str]()

    @contextmanager
    def room(self, db: Database, client: str) -> Iterator[list[int]]:
        """Keep a place for one more run of a client while it begins; its number goes into the list.

        Raises:
            TooManyRunsError: as many of this client live or begin as may.
        """
        self._forget_ended(db, client)
        with self._lock:
            taken = len(self._of.get(client, ())) + self._beginning[client]
            if taken >= self.most:
                raise TooManyRunsError(OF_CLIENT, number=taken)
            self._beginning[client] += 1
        begun: list[int] = []
        try:
            yield begun
        finally:
            with self._lock:
                self._beginning -= Counter([client])
                self._of.setdefault(client, set()).update(begun)

    def _forget_ended(self, db: Database, client: str) -> None:
        """Forget the runs of a client that are over, if it has as many as may live."""
        with self._lock:
            started = set(self._of.get(client, ()))
        if len(started) < self.most:
            return
        with db.read() as session:
            living = set(session.scalars(select(Run.id).where(Run.id.in_(started), Run.status.in_(LIVING))))
        with self._lock:
            self._of[client] = self._of.get(client, set()) - (started - living)
