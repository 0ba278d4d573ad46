"""Trackers of `train`: what they are told of a batch, outside of its ticks."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from parenting.experiments.training.batch import BatchTrainer
from parenting.experiments.training.counts import Progress as BatchProgress
from parenting.library.task import Task
from parenting.server.public_ids import public_id
from parenting.server.trackers.choosing import UnknownTrackerError, feeds
from parenting.server.trackers.feed import Feeds
from parenting.server.trackers.tracker import TrackedRun, Tracker, Values

Trackers = str | Tracker | Sequence[str | Tracker] | None
ROW_SECONDS = 1.0
"""Seconds after which metrics are told though nothing was answered."""
CLOSE_SECONDS = 5.0
"""Seconds that each tracker has at the end for what it was not told yet."""


def feeds_of(trackers: Trackers) -> Feeds:
    """Return the feeds of an argument `trackers`.

    Raises:
        ValueError: one of them is not a tracker; the message says what is one.
    """
    if trackers is None:
        return Feeds([])
    several = [trackers] if isinstance(trackers, str) or not isinstance(trackers, Sequence) else trackers
    try:
        return feeds(several)
    except UnknownTrackerError as error:
        raise ValueError(f"trackers: {error}") from None


class Tracking:
    """The trackers of one training: all of its batches are one run of theirs, and its steps go on."""

    def __init__(self, told: Feeds) -> None:
        self._told, self._id = told, public_id()
        self._before = self._step = 0
        self._seen, self._at = (-1, -1), 0.0

    @contextmanager
    def of(self, task: Task, seed: int) -> Iterator[None]:
        """Tell that the training begins, and at last how it ended."""
        reason, level = "The training failed or was interrupted.", task.world.levels[0].name
        config = task.config.model_dump(mode="json")
        self._told.begin(
            TrackedRun(self._id, f"{task.world.name} {level}", task.world.name, level, seed, config)
        )
        try:
            yield
            reason = "The training ended."
        finally:
            self._told.end(self._id, reason)
            self._told.close(CLOSE_SECONDS)

    def watching(self, trainer: BatchTrainer, report: Callable[[BatchProgress], None]) -> Callable[..., None]:
        """Return what is called after each tick: it tells metrics after answers, and once a second."""
        if not self._told.feeds:
            return report
        self._before, self._seen = self._step, (-1, -1)

        def tell(now: BatchProgress) -> None:
            self._step = self._before + now.ticks
            seen, late = (now.queries, now.trials), time.monotonic() - self._at
            if seen != self._seen or late >= ROW_SECONDS:
                self._seen, self._at = seen, time.monotonic()
                self._told.log(self._id, self._step, _values(trainer, now))
            report(now)

        return tell


def _values(trainer: BatchTrainer, now: BatchProgress) -> Values:
    """Return metrics by the names that stored runs have: means over the trials of the batch that are left."""
    state, counts = trainer.state, trainer.counts
    means = {
        **{name: getattr(counts, name) for name in ("deaths", "guidance", "preference", "maturity")},
        "size": state.x.size,
        "rows": state.x.rows,
        **{name: getattr(state.info, name) for name in ("loss", "entropy_global", "entropy_local")},
    }
    found = {name: float(values.double().mean()) for name, values in means.items() if len(values)}
    return {**found, "finished": now.trials, "queries": now.queries}
