"""The stored runs of a worker, as its trackers are told of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from sqlalchemy import func, select

from parenting.server import runs
from parenting.server.db import Database
from parenting.server.errors import NotFound, SetupError, StoreError
from parenting.server.tables import Metric, Run
from parenting.server.trackers.choosing import UnknownTrackerError, feeds
from parenting.server.trackers.feed import Feeds
from parenting.server.trackers.tracker import TrackedRun, Values

CLOSE_SECONDS = 0.5
"""Seconds that each tracker has at a worker's end for what it was not told yet."""


def chosen_feeds(text: str) -> Feeds:
    """Return the trackers of the setting.

    Raises:
        SetupError: one of them is none.
    """
    try:
        return feeds(one for one in text.split(",") if one.strip())
    except UnknownTrackerError as error:
        raise SetupError(f"PARENTING_TRACKERS: {error}") from None


class TrackedRuns:
    """The runs that trackers are told of: each begins once, until it ends or goes on elsewhere."""

    def __init__(self, db: Database, told: Feeds) -> None:
        self.db, self.told = db, told
        self._names: dict[int, str] = {}

    def begin(self, run: Run) -> Callable[[int, Values], None]:
        """Tell that a run is taken up; return the function that takes its metrics."""
        if self.told.feeds and run.id not in self._names:
            self._names[run.id] = run.public_id
            known = (run.public_id, run.name or f"run {run.id}", run.world, run.level, run.seed, run.config)
            self.told.begin(TrackedRun(*known), self._told_before(run.id))
        return partial(self.told.log, run.public_id)

    def end(self, run_id: int) -> None:
        """Tell that a run is over, or that this worker raises it no more."""
        name = self._names.pop(run_id, None)
        if name is not None:
            self.told.end(name, self._reason(run_id))

    def close(self) -> None:
        """Tell the end of all that this worker raises."""
        for name in self._names.values():
            self.told.end(name, "The worker ended.")
        self.told.close(CLOSE_SECONDS)

    def _told_before(self, run_id: int) -> int:
        """Return the last step that has metrics already, which a replay measures again; -1 without any."""
        with self.db.read() as session:
            last = session.scalar(select(func.max(Metric.tick)).where(Metric.run_id == run_id))
        return -1 if last is None else int(last)

    def _reason(self, run_id: int) -> str:
        try:
            run = runs.stored_run(self.db, run_id)
        except (StoreError, NotFound):
            return "This worker raises it no more."
        return f"{run.status}: {run.reason or 'this worker raises it no more.'}"
