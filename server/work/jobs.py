"""Jobs beside the runs of a worker: each is claimed as soon as it is seen, and done in a thread of its own.

The worker's loop calls `begin` between the turns of its runs, so that a job waits for none of them. What a
turn does and what a job does share nothing: a job reads a checkpoint into a world of its own.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait

import structlog
import torch
from sqlalchemy.exc import StatementError

from parenting.server import jobs
from parenting.server.db import Database
from parenting.server.errors import LostClaimError, ServerError, StoreError
from parenting.server.failures import said_by
from parenting.server.jobs import JobClaim
from parenting.server.work.courtesy import Courtesy
from parenting.server.work.doers import do

log = structlog.get_logger()

AT_ONCE = 2
"""Jobs of a worker at a time. More would only take the processor from its runs."""
LOOK_SECONDS = 0.1
"""Seconds between two looks for jobs, at the least: a worker that raises runs commits all the time."""


class Jobs:
    """The jobs that a worker is at."""

    def __init__(
        self, db: Database, seconds: float, done: Callable[[], None], courtesy: Courtesy | None = None
    ) -> None:
        """Nothing is claimed yet.

        Args:
            db: The database.
            seconds: How long a claim holds without a sign of life.
            done: Called in another thread when a job has ended.
            courtesy: The turns of runs before which jobs stand back.
        """
        self.db, self.seconds, self._done = db, seconds, done
        self._courtesy = courtesy or Courtesy()
        self._working: dict[JobClaim, Future[None]] = {}
        self._news, self._looked_at = True, -math.inf
        self._pool = ThreadPoolExecutor(AT_ONCE, "job", initializer=torch.set_num_threads, initargs=(1,))

    def news(self) -> None:
        """Take note that somebody has committed something: there may be a job."""
        self._news = True

    def begin(self, worker: str) -> None:
        """Claim jobs and begin them, if there are any and a thread is free.

        Without a commit of anybody, nothing but time can have freed a job.
        """
        self._working = {mine: begun for mine, begun in self._working.items() if not begun.done()}
        free = AT_ONCE - len(self._working)
        late = time.monotonic() - self._looked_at
        if not free or late < (LOOK_SECONDS if self._news else self.seconds / 2):
            return
        self._looked_at, self._news = time.monotonic(), True  # should the store refuse to tell
        long = not any(mine.run_id == jobs.NO_RUN for mine in self._working)
        if not jobs.waits(self.db, self.seconds, long):
            self._news = False
            return
        for mine in jobs.claim(self.db, worker, free, self.seconds, long):
            self._working[mine] = self._pool.submit(self._do, mine)  # there may be more: it stays news

    def renew(self) -> None:
        """Give a sign of life of every job that goes on."""
        jobs.renew(self.db, self._going_on())

    def working(self) -> bool:
        """Return whether a job goes on."""
        return bool(self._going_on())

    def close(self, seconds: float) -> None:
        """Begin no more, and wait for the jobs that go on, at most for some seconds."""
        wait(self._working.values(), seconds)
        self._pool.shutdown(wait=False, cancel_futures=True)

    def let_go(self) -> None:
        """Give back what is not done: another worker takes it at once."""
        jobs.let_go(self.db, self._going_on())

    def _going_on(self) -> list[JobClaim]:
        working = list(self._working.items())  # the loop may add one meanwhile
        return [mine for mine, begun in working if not begun.done()]

    def _do(self, mine: JobClaim) -> None:
        """Do a job and store its result, or the reason why there is none. A refusing store leaves it open."""
        began = time.monotonic()
        try:
            self._tried(mine)
            took = time.monotonic() - began
            log.info("job ended", job=mine.job_id, kind=mine.kind, run=mine.run_id, ms=round(1e3 * took))
        except LostClaimError as error:
            log.warning("job lost", job=mine.job_id, reason=error.message)
        except StoreError as error:
            log.warning("store refuses; the job is tried again", job=mine.job_id, why=error.message)
        self._done()

    def _tried(self, mine: JobClaim) -> None:
        try:
            with self._courtesy.turn(None, hurried=False):
                result = do(self.db, mine)
        except StoreError:
            raise
        except Exception as error:
            log.error("job failed", job=mine.job_id, kind=mine.kind, run=mine.run_id, error=repr(error))
            jobs.fail(self.db, mine, _reason(mine, error))
        else:
            jobs.finish(self.db, mine, result)


def _reason(mine: JobClaim, error: Exception) -> str:
    """Return why a job failed, in a sentence for people."""
    if isinstance(error, (ServerError, StatementError)):
        said = said_by(error)
    else:
        said = f"{type(error).__name__}: {error}"
    return f"The worker could not do this ({mine.kind}): {said}"
