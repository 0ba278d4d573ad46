"""Group commit: one thread stores the writes of many requests in one transaction of SQLite.

A durable commit waits for the disk, however little it holds. What arrives meanwhile is stored together: up to
`MOST` requests, each in a savepoint of its own, so that one that is refused undoes its own part only. Nobody
is told anything before the commit of the whole, and where that fails, everybody is told so. A request that
was cut off by such a failure is sent again and learns the truth.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from contextlib import suppress
from contextvars import Context, copy_context
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from sqlalchemy.orm import Session

from parenting.server.admission import WAITING
from parenting.server.db import Database
from parenting.server.errors import BusyError, ServerError, StoreError
from parenting.server.store.patience import patience
from parenting.server.store.refusals import refusal

Found = TypeVar("Found")
MOST = 64
"""Requests in one transaction."""
CLOSE_SECONDS = 1.0
"""Seconds that an end waits for the thread; one that waits for a locked store ends with its process."""


@dataclass(eq=False)
class Write:
    """A request that waits for its commit."""

    verb: Callable[[Session], Any]
    durable: bool
    deadline: float
    worth: Callable[[Session], bool] | None
    told: asyncio.Future[Any]
    context: Context = field(default_factory=copy_context)  # of the request, which lines of the log name
    taken: bool = False  # a group has it, so that its end is no more than seconds away
    left: bool = False  # it waited for too long
    outcome: Any = None
    error: BaseException | None = field(default=None)

    def tell(self) -> None:
        """Tell the coroutine that waits, in its event loop."""
        if self.told.done():
            return
        if self.error is None:
            self.told.set_result(self.outcome)
        else:
            self.told.set_exception(self.error)


class GroupCommit:
    """The thread of one web process, and the queue before it."""

    def __init__(self, db: Database, most: int = MOST, waiting: int = WAITING) -> None:
        self.db = db
        self._most, self._room, self.waiting = most, most + waiting, 0
        self._queue: SimpleQueue[Write | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    async def store(
        self,
        verb: Callable[[Session], Found],
        seconds: float,
        durable: bool = True,
        worth: Callable[[Session], bool] | None = None,
    ) -> Found:
        """Call a verb in a transaction, and return what it returned once that is committed.

        Args:
            verb: What is to be done. It writes by statements, not by changes of objects, and locks nothing.
            seconds: How long it may wait for its group.
            durable: It is promised to somebody (`Database.write`).
            worth: Return whether there is anything to write. It is asked in a transaction that only reads,
                if nobody in the group writes anyway. For verbs that may return None: where it is not worth
                it, the result is None.

        Raises:
            BusyError: too many wait, or its turn did not come in time; nothing was stored.
            StoreError: the store refused; nothing was stored, as far as is known.
        """
        if self.waiting >= self._room:
            raise BusyError("Too many requests wait for the database; nothing was stored. Send it again.")
        loop = asyncio.get_running_loop()
        write = Write(verb, durable, time.monotonic() + seconds, worth, loop.create_future())
        self._begin()
        self.waiting += 1
        timer = loop.call_later(seconds, self._leave, write)
        self._queue.put(write)
        try:
            found: Found = await write.told
            return found
        finally:
            timer.cancel()
            self.waiting -= 1

    def close(self) -> None:
        """End the thread after the writes that wait already."""
        thread, self._thread = self._thread, None
        if thread is not None:
            self._queue.put(None)
            thread.join(CLOSE_SECONDS)

    def _begin(self) -> None:
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, daemon=True, name="group commit")
            self._thread.start()

    def _leave(self, write: Write) -> None:
        with self._lock:
            write.left = not write.taken
        if write.left:
            write.error = BusyError()
            write.tell()

    def _run(self) -> None:
        group: list[Write] = []
        open_ = True
        while open_ or group:
            open_ = self._gather(group) and open_
            again = self._store(group) if group else []
            _tell([write for write in group if write not in again])
            group = again

    def _gather(self, group: list[Write]) -> bool:
        """Add what waits to a group, at least one; return whether more may come."""
        with suppress(Empty):
            while len(group) < self._most:
                write = self._queue.get(block=not group)
                if write is None:
                    return False
                with self._lock:
                    write.taken = not write.left
                if write.taken:
                    group.append(write)
        return True

    def _store(self, group: list[Write]) -> list[Write]:
        """Store a group, and return those that may still wait, as the store let nobody begin."""
        begun = done = False
        try:
            group = self._worth_it(group)
            if not group:
                return []
            least = min(write.deadline for write in group) - time.monotonic()
            with patience(least), self.db.write(any(write.durable for write in group)) as session:
                begun = True
                for write in group:
                    _call(write, session, alone=len(group) == 1)
                done = True
        except BaseException as error:  # whatever it is, those who wait must be told
            now = time.monotonic()
            late = [write for write in group if write.deadline <= now]
            if isinstance(error, BusyError) and not begun and late:
                for write in late:
                    write.error = error
                return [write for write in group if write not in late]
            if (
                begun and not done and len(group) > 1
            ):  # by the statements of one: the others are not to suffer
                for write in group:
                    write.outcome = write.error = None
                    self._store([write])
                return []
            for write in group:
                write.error = error
        return []

    def _worth_it(self, group: list[Write]) -> list[Write]:
        """Return those of a group that have something to write."""
        if any(write.worth is None for write in group):
            return group
        with self.db.read() as session:
            return [write for write in group if _is_worth_it(write, session)]


def _is_worth_it(write: Write, session: Session) -> bool:
    try:
        return write.worth is None or write.context.run(write.worth, session)
    except ServerError:  # the verb says the same, to this one alone
        return True


def _call(write: Write, session: Session, alone: bool) -> None:
    """Call one verb of a group.

    Raises:
        Exception: it was refused, if it is alone, or the store refused it.
    """
    if alone:
        write.outcome = write.context.run(write.verb, session)
        return
    connection = session.connection()
    connection.exec_driver_sql("SAVEPOINT request")
    try:
        write.outcome = write.context.run(write.verb, session)
    except Exception as error:
        if isinstance(error, StoreError) or refusal(error) is not None:
            raise
        write.error = error
        session.expunge_all()
        connection.exec_driver_sql("ROLLBACK TO request")
    connection.exec_driver_sql("RELEASE request")


def _tell(group: Sequence[Write]) -> None:
    loops = defaultdict[asyncio.AbstractEventLoop, list[Write]](list)
    for write in group:
        loops[write.told.get_loop()].append(write)
    for loop, writes in loops.items():
        with suppress(RuntimeError):  # the loop is closed: nobody waits any more
            loop.call_soon_threadsafe(_tell_all, writes)


def _tell_all(writes: Sequence[Write]) -> None:
    for write in writes:
        write.tell()
