"""PostgreSQL's connections: how a transaction begins on one, and whether one that was kept still lives.

Each message to the server and back costs both sides processor time. So a transaction begins by one message,
which says all that is particular to it and asks for the time, and a kept connection is asked whether it lives
only if there is a reason. A server that ends a connection says so on it, where libpq has not read it yet; a
network that went silent says nothing, so after some seconds without use the server is asked.
"""

from __future__ import annotations

import select
from contextlib import suppress
from functools import partial
from typing import Any

from sqlalchemy import Connection, Engine, event
from sqlalchemy.exc import InvalidatePoolError

from parenting.server.store.clock import SERVER_TIME, ServerTime, since_boot
from parenting.server.store.patience import remaining

QUIET_SECONDS = 5.0
"""Seconds without use after which a connection is asked before it is used again."""
PROMPT_SECONDS = 0.1
"""Seconds within which the server's reply must come for its clock to be right to so many."""
TIME = "SELECT extract(epoch FROM clock_timestamp())"
WRITING = "ISOLATION LEVEL READ COMMITTED"
READING = "ISOLATION LEVEL REPEATABLE READ READ ONLY"


def watch(engine: Engine, lock_seconds: float | None) -> None:
    """Begin the transactions of an engine, and give out connections that live only.

    A transaction waits for a lock no longer than its caller may (`server.store.patience`), if that is less
    than `lock_seconds`, the connections' own limit; with None it is always the latter.

    The execution option `reads` begins those that only read, on one snapshot. With `synchronous` set to
    "normal" a commit does not wait for the disk. With AUTOCOMMIT none begins.
    """
    event.listen(engine, "checkin", _left)
    event.listen(engine, "checkout", _require_alive)
    event.listen(engine, "begin", partial(_begin, lock_seconds=lock_seconds))
    event.listen(engine, "rollback", _end_reading)


def said(driver: Any, command: bytes) -> Any:
    """Return libpq's result of a command, which it sends as directly as psycopg allows.

    It takes a third of the processor time of a cursor.

    Raises:
        psycopg.Error: the server said no, or is gone.
    """
    import psycopg  # an extra of its own: whoever has no PostgreSQL need not have it

    result = driver.pgconn.exec_(command)
    if result.status not in (psycopg.pq.ExecStatus.TUPLES_OK, psycopg.pq.ExecStatus.COMMAND_OK):
        if result.error_field(psycopg.pq.DiagnosticField.SQLSTATE) is None:  # the server said nothing
            raise psycopg.OperationalError(result.error_message.decode(errors="replace"))
        raise psycopg.errors.error_from_result(result)
    return result


def _left(_driver: Any, record: Any) -> None:
    record.info["used"] = since_boot()


def _require_alive(driver: Any, record: Any, _proxy: Any) -> None:
    """Have the pool connect again where a connection is gone, and the others with it.

    Raises:
        InvalidatePoolError: it is gone.
    """
    import psycopg

    used = record.info.get("used")
    if used is None or (since_boot() - used < QUIET_SECONDS and not _was_told(driver)):
        return
    try:
        said(driver, b"SELECT 1")
    except psycopg.Error as error:
        raise InvalidatePoolError from error


def _was_told(driver: Any) -> bool:
    """Return whether the server has said something that nobody asked for, or ended the connection."""
    poll = select.poll()  # select.select takes low numbers of files only
    poll.register(driver.pgconn.socket, select.POLLIN)
    return bool(poll.poll(0))


def _begin(connection: Connection, lock_seconds: float | None) -> None:
    connection.info.pop(SERVER_TIME, None)
    options = connection.get_execution_options()
    if options.get("isolation_level") == "AUTOCOMMIT":
        return
    commands = [f"BEGIN {READING if options.get('reads') else WRITING}", TIME]
    if options.get("synchronous") == "normal":
        commands.insert(1, "SET LOCAL synchronous_commit = off")
    if lock_seconds is not None and (left := remaining(lock_seconds)) < 0.9 * lock_seconds:
        commands.insert(1, f"SET LOCAL lock_timeout = {max(int(1000 * left), 1)}")  # 0 would mean: no limit
    sent = since_boot()
    try:
        result = said(connection.connection.dbapi_connection, "; ".join(commands).encode())
    except BaseException as error:
        connection.invalidate(error)  # SQLAlchemy does so where a statement fails, but not here
        raise
    heard = since_boot()
    if heard - sent < PROMPT_SECONDS:
        connection.info[SERVER_TIME] = ServerTime(float(result.get_value(0, 0)), heard)


def _end_reading(connection: Connection) -> None:
    """End a transaction that only read by COMMIT: at a ROLLBACK psycopg forgets what it has prepared.

    It could have done nothing that stays but SET and NOTIFY, which no reader of ours does.
    """
    import psycopg

    if connection.invalidated or not connection.get_execution_options().get("reads"):
        return
    driver: Any = connection.connection.dbapi_connection
    if driver.pgconn.transaction_status == psycopg.pq.TransactionStatus.INTRANS:
        with suppress(psycopg.Error):  # the connection is gone, as the ROLLBACK will see
            said(driver, b"COMMIT")
