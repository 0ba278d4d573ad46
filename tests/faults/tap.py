"""A tap between SQLAlchemy and the driver: every statement and every commit of a process passes by here.

The product knows nothing of it. A test puts listeners on the tap, in its own process or in one that it
starts: they kill the process at a named point, raise what a driver would raise, or note where the process is.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from sqlalchemy.engine.default import DefaultDialect

WRITE = re.compile(r"\s*(INSERT INTO|UPDATE|DELETE FROM|CREATE|DROP|ALTER)\b", re.IGNORECASE)
COMMIT = "COMMIT"


class Moment(NamedTuple):
    """A place on the way to the driver."""

    when: str  # before, after
    act: str  # the statement, or COMMIT
    writes: tuple[str, ...]  # the writing statements of the transaction so far


Listener = Callable[[Moment], None]
_listeners: list[Listener] = []
_writes: defaultdict[int, list[str]] = defaultdict(list)
_kept: tuple[Any, Any, Any] = (
    DefaultDialect.do_execute,
    DefaultDialect.do_executemany,
    DefaultDialect.do_commit,
)


def listen(listener: Listener) -> None:
    """Put a listener on the tap for the rest of this process."""
    if not _listeners:
        _install()
    _listeners.append(listener)


def forget(listener: Listener) -> None:
    """Take a listener off the tap; with the last one the tap itself is taken away."""
    _listeners.remove(listener)
    if not _listeners:
        DefaultDialect.do_execute, DefaultDialect.do_executemany, DefaultDialect.do_commit = _kept  # type: ignore[method-assign]  # the tap is taken away


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Put a listener on the tap for a while."""
    listen(listener)
    try:
        yield
    finally:
        forget(listener)


def _install() -> None:
    execute, executemany, commit = _kept

    def tapped_execute(self: Any, cursor: Any, statement: str, *rest: Any, **named: Any) -> None:
        _statement(cursor, statement, lambda: execute(self, cursor, statement, *rest, **named))

    def tapped_executemany(self: Any, cursor: Any, statement: str, *rest: Any, **named: Any) -> None:
        _statement(cursor, statement, lambda: executemany(self, cursor, statement, *rest, **named))

    def tapped_commit(self: Any, connection: Any) -> None:
        key = id(getattr(connection, "dbapi_connection", connection))
        writes = tuple(_writes[key])
        _tell(Moment("before", COMMIT, writes))
        commit(self, connection)
        _writes.pop(key, None)
        _tell(Moment("after", COMMIT, writes))

    DefaultDialect.do_execute = tapped_execute  # type: ignore[method-assign]  # this is the tap
    DefaultDialect.do_executemany = tapped_executemany  # type: ignore[method-assign]  # this is the tap
    DefaultDialect.do_commit = tapped_commit  # type: ignore[method-assign]  # this is the tap


def _statement(cursor: Any, statement: str, execute: Callable[[], None]) -> None:
    writes = _writes[id(cursor.connection)]
    if statement.startswith("BEGIN"):
        writes.clear()
    _tell(Moment("before", statement, tuple(writes)))
    execute()
    if WRITE.match(statement):
        writes.append(statement)
    _tell(Moment("after", statement, tuple(writes)))


def _tell(moment: Moment) -> None:
    for listener in tuple(_listeners):
        listener(moment)
