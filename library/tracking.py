"""Trackers of `train`: what they are told of trials, outside of their ticks.

One trial is told while it is trained. Of several each is a run of its own, with the rows that `parenting run`
tells of it, once its batch has ended: a mean over the trials of a batch would start at 0 again with the next.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import structlog

from parenting.experiments.training.batch import BatchTrainer
from parenting.experiments.training.counts import Progress as BatchProgress
from parenting.experiments.training.history import metrics
from parenting.experiments.training.stop_rule import StopRule
from parenting.library.task import Task
from parenting.server.public_ids import public_id
from parenting.server.trackers.choosing import UnknownTrackerError, feeds
from parenting.server.trackers.feed import Feed, Feeds
from parenting.server.trackers.tracker import TrackedRun, Tracker, Values

Trackers = str | Tracker | Sequence[str | Tracker] | None
ROW_SECONDS = 1.0
"""Seconds after which metrics are told though nothing was answered."""
CLOSE_SECONDS = 5.0
"""Seconds that each tracker has at the end for what it was not told yet, and for each trial of several."""

log = structlog.get_logger()


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
    """The trackers of one training: each of its trials is a run of theirs."""

    def __init__(self, told: Feeds, trials: int) -> None:
        self._told, self._id = told, public_id()
        self._all, self._alone = told, trials == 1
        self._seen, self._at = (-1, -1), 0.0
        self._run: TrackedRun

    @property
    def wants_history(self) -> bool:
        """Return whether the rows of each trial are told after its batch."""
        return bool(self._told.feeds) and not self._alone

    @contextmanager
    def of(self, task: Task, seed: int) -> Iterator[None]:
        """Tell that the training begins, and at last how it ended."""
        reason, level = "The training failed or was interrupted.", task.world.levels[0].name
        config = task.config.model_dump(mode="json")
        self._run = TrackedRun(self._id, f"{task.world.name} {level}", task.world.name, level, seed, config)
        if self._alone:
            self._told.begin(self._run)
        try:
            yield
            reason = "The training ended."
        finally:
            if self._alone:
                self._told.end(self._id, reason)
            self._all.close(CLOSE_SECONDS)

    def watching(self, trainer: BatchTrainer, report: Callable[[BatchProgress], None]) -> Callable[..., None]:
        """Return what is called after each tick: it tells metrics after answers, and once a second."""
        if not self._told.feeds or not self._alone:
            return report

        def tell(now: BatchProgress) -> None:
            seen, late = (now.queries, now.trials), time.monotonic() - self._at
            if seen != self._seen or late >= ROW_SECONDS:
                self._seen, self._at = seen, time.monotonic()
                self._told.log(self._id, now.ticks, _values(trainer, now))
            report(now)

        return tell

    def ended(self, trainer: BatchTrainer, chunk: range, until: StopRule) -> None:
        """Tell the trials of a batch that has ended, one after the other, if there are several in all."""
        if trainer.history is None:
            return
        for place, number in enumerate(chunk):
            run = replace(self._run, id=public_id(), name=f"{self._run.name}, trial {number}")
            finished, stuck = (bool(getattr(trainer.result, one)[place]) for one in ("finished", "stuck"))
            self._told.begin(run)
            for tick, values in sorted(metrics(trainer.history.table[place]).items()):
                last = finished and tick == int(trainer.result.ticks[place])
                queries = values["guidance"] + values["preference"]
                self._told.log(run.id, tick, {**values, "finished": int(last), "queries": queries})
            self._told.end(run.id, _ending(finished, stuck, until))
            self._told = Feeds([feed for feed in self._told.feeds if _drained(feed)])


def _drained(feed: Feed) -> bool:
    """Wait for a tracker, since only so many rows wait for it; whether it may be told of more trials."""
    in_time = feed.drained(CLOSE_SECONDS)
    if not in_time:
        log.warning("a tracker is too slow; it is told of no more trials", tracker=feed.name)
    return in_time


def _ending(finished: bool, stuck: bool, until: StopRule) -> str:
    if stuck:
        return "No action was acceptable."
    return f"It came to the end that was set: {until}." if finished else "It was left unfinished."


def _values(trainer: BatchTrainer, now: BatchProgress) -> Values:
    """Return metrics of the one trial by the names that stored runs have; once it is done, its counts."""
    state, done = trainer.state, not len(trainer.counts.ticks)  # it leaves the batch
    counts = trainer.result if done else trainer.counts
    means = {
        **{name: getattr(counts, name) for name in ("deaths", "guidance", "preference", "maturity")},
        "size": state.x.size,
        "rows": state.x.rows,
        **{name: getattr(state.info, name) for name in ("loss", "entropy_global", "entropy_local")},
    }
    found = {name: float(values.double().mean()) for name, values in means.items() if len(values)}
    return {**found, "finished": now.trials, "queries": now.queries}
