"""The hook of trackers: three methods."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

Values = Mapping[str, float | int | None]


@dataclass(frozen=True)
class TrackedRun:
    """A run as a tracker is told of it."""

    id: str  # the public id of a stored run; a random one of `pt.train`
    name: str
    world: str
    level: str
    seed: int
    config: Mapping[str, Any]


@runtime_checkable
class Tracker(Protocol):
    """A program that follows trainings; a worker tells one of several runs.

    Its methods are called in one thread of their own, never within a tick. What they raise is counted, and
    said in the log.
    """

    def begin(self, run: TrackedRun) -> None:
        """A run begins, or a worker goes on with it."""

    def log(self, run: str, step: int, values: Values) -> None:
        """Take the metrics of a run, by its id. The step, a tick, grows; None: no value."""

    def end(self, run: str, reason: str) -> None:
        """A run has ended, or a worker goes on with it no more."""
