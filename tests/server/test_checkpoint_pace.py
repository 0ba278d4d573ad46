"""The pace of checkpoints on a clock that the test moves: a twentieth of a run's time at most."""

import math

import pytest

from parenting.server.checkpoint_pace import (
    CHECKPOINT_SECONDS,
    CHECKPOINT_SHARE,
    QUIET_SECONDS,
    CheckpointPace,
)
from parenting.server.checkpoint_pace import LONGEST_QUIET_SECONDS as MOST
from parenting.server.pressure import Pressure


class Time:
    """Stands still until it is moved."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def lived(tick: float, wait: float, took: float, size: int, ticks: int) -> tuple[float, float, float]:
    """Seconds that ticks took, that checkpoints took, and the most work that one of them was written for."""
    clock = Time()
    pace, spent, most = CheckpointPace(clock), 0.0, 0.0
    for _ in range(ticks):
        clock.now += tick + wait
        pace.work += tick
        if pace.due:
            most = max(most, pace.work)
            clock.now += took
            spent += took
            pace.saved(took, size)
    return tick * ticks, spent, most


@pytest.mark.slow_after(6)
@pytest.mark.parametrize("size", [200_000, 100_000_000, 10_000_000_000])
@pytest.mark.parametrize("took", [0.02, 0.5, 30.0])
@pytest.mark.parametrize("tick", [0.003, 0.4])
def test_checkpoints_take_a_twentieth_of_a_busy_run_whatever_they_cost(
    tick: float, took: float, size: int
) -> None:
    work, spent, most = lived(tick, 0.0, took, size, 200_000 if tick < 0.1 else 10_000)
    first = took  # the cost of the first is not known before it
    assert first <= spent <= first + CHECKPOINT_SHARE * work
    if took < 1 and size < 1e6:
        assert most <= max(CHECKPOINT_SECONDS, took / CHECKPOINT_SHARE) + 2 * tick, "a restart repeats little"


def test_a_run_of_many_answers_writes_by_its_work_and_not_by_the_clock() -> None:
    """An answer a second, ticks of 8 ms and checkpoints of 20 ms: every two seconds would double its cost."""
    work, spent, _ = lived(tick=0.008, wait=0.992, took=0.02, size=300_000, ticks=3600)
    assert spent <= 0.02 * (3600 / QUIET_SECONDS + 1) < 0.3 * work


def test_a_quiet_run_is_saved_once_and_a_large_one_by_its_work_alone() -> None:
    clock = Time()
    pace = CheckpointPace(clock)
    pace.saved(0.02, 300_000)
    pace.work = 0.01
    assert pace.next == QUIET_SECONDS
    pace.work = 1.0
    assert pace.next == CHECKPOINT_SECONDS
    pace.saved(0.02, 60_000_000)
    assert pace.large
    assert pace.next == math.inf


def test_the_quiet_runs_of_a_worker_together_are_saved_once_a_second() -> None:
    """Twenty-five runs that answer now and then would otherwise write two or three in each."""
    clock, pressure = Time(), Pressure()
    pace = CheckpointPace(clock, pressure)
    pace.saved(0.02, 300_000)
    pace.work = 0.01
    for runs, seconds in ((1, QUIET_SECONDS), (10, QUIET_SECONDS), (25, 25.0), (1000, MOST)):
        pressure.runs = runs
        assert pace.next == seconds
