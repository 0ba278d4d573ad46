"""A worker waits for a store that refuses: a little longer each time, and with few lines in its log."""

from __future__ import annotations

import pytest
from structlog.testing import capture_logs

from parenting.server.errors import BusyError, DiskFullError
from parenting.server.work.patience import CALM_SECONDS, FIRST_WAIT, LONGEST_WAIT, Patience


class Clock:
    now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("parenting.server.work.patience.time.monotonic", clock)
    return clock


def test_the_wait_doubles_up_to_its_bound_with_jitter(clock: Clock) -> None:
    patience, waits = Patience(), []
    for _ in range(12):
        patience.refused(BusyError())
        waits.append(patience.left())
        clock.now += patience.left()
    for number, wait in enumerate(waits):
        full = min(LONGEST_WAIT, FIRST_WAIT * 2**number)
        assert full / 2 - 1e-9 <= wait <= full + 1e-9
    assert len(set(waits)) == len(waits)


def test_the_refusal_of_one_run_makes_no_other_wait(clock: Clock) -> None:
    """Three hundred runs may be refused at once, and the log has one line."""
    patience = Patience()
    with capture_logs() as lines:
        for run in range(300):
            patience.doubted(BusyError(), run)
    assert len(lines) == 1
    assert patience.doubts
    assert not patience.waits
    patience.granted()
    assert not patience.doubts


def test_the_end_of_refusals_of_runs_has_one_line(clock: Clock) -> None:
    patience = Patience()
    with capture_logs() as lines:
        for run in range(300):
            patience.doubted(BusyError(), run)
        clock.now += 2.5
        patience.granted()  # the loop's own writes pass, and the runs are not asked yet
        for _ in range(300):
            patience.dispelled()
    assert [line["event"] for line in lines][1:] == ["store is back after 2.5 s"]


def test_the_log_has_a_line_a_second_for_each_refusal_and_one_at_the_end(clock: Clock) -> None:
    patience = Patience()
    with capture_logs() as lines:
        for _ in range(123):
            patience.refused(BusyError())
            patience.refused(DiskFullError())
            clock.now += 0.1
        patience.granted()
        patience.granted()
    refused = [line["code"] for line in lines if "code" in line]
    assert refused.count("busy") == refused.count("disk_full")
    assert 12 <= refused.count("busy") <= 13
    assert lines[-1]["event"] == "store is back after 12.3 s"
    assert len(lines) == len(refused) + 1


def test_a_store_that_is_back_is_asked_at_once(clock: Clock) -> None:
    patience = Patience()
    patience.refused(BusyError())
    assert patience.waits
    patience.granted()
    assert not patience.waits
    assert patience.left() == 0


def test_a_store_that_refuses_again_and_again_is_asked_ever_less(clock: Clock) -> None:
    """A nearly full disk takes a sign of life and refuses a checkpoint."""
    patience = Patience()
    with capture_logs() as lines:
        for _ in range(10):
            patience.refused(DiskFullError())
            wait = patience.left()
            clock.now += wait
            patience.granted()
    assert wait >= LONGEST_WAIT / 2
    assert len(lines) < 20
    clock.now += CALM_SECONDS
    patience.refused(DiskFullError())
    assert patience.left() <= FIRST_WAIT
