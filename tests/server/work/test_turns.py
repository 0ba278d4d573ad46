"""A long turn of one run holds up no other, and each run has one turn at a time."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest
import torch

from parenting.server.work import turns
from parenting.server.work.turns import LONG_AT_ONCE, Turns


@pytest.fixture
def woken() -> threading.Event:
    return threading.Event()


@pytest.fixture
def gate() -> Iterator[threading.Event]:
    """The event that long turns wait for."""
    gate = threading.Event()
    yield gate
    gate.set()


def until_woken(woken: threading.Event) -> None:
    assert woken.wait(30)
    time.sleep(0.01)  # the turn's end is noted before or just after the call


def held(gate: threading.Event, due: float = 7.0) -> float:
    assert gate.wait(30)
    return due


def test_a_quick_turn_is_over_when_begin_returns(woken: threading.Event) -> None:
    some = Turns(woken.set, beside_after=30)
    some.begin(1, lambda: 5.0)
    assert some.ended() == {1: 5.0}
    assert some.ended() == {}
    assert not woken.is_set()


def test_a_long_turn_goes_on_beside_a_quick_one(woken: threading.Event, gate: threading.Event) -> None:
    some = Turns(woken.set, beside_after=0.02)
    some.begin(1, lambda: held(gate))
    some.begin(2, lambda: 3.0)
    assert some.ended() == {2: 3.0}
    assert some.working() == {1}
    assert not some.may_begin(1, new=False)
    gate.set()
    until_woken(woken)
    assert some.ended() == {1: 7.0}
    assert some.may_begin(1, new=False)


@pytest.mark.parametrize(("worked", "waited_for"), [(turns.LONG_SECONDS + 0.01, 1), (0.0, 2)])
def test_a_turn_that_took_the_processor_long_is_not_waited_for_the_next_time(
    woken: threading.Event,
    gate: threading.Event,
    monkeypatch: pytest.MonkeyPatch,
    worked: float,
    waited_for: int,
) -> None:
    """One that waited for the store, or for others, is."""
    spent = iter([0.0, worked, 0.0, 0.0, 0.0, 0.0])
    monkeypatch.setattr("parenting.server.work.turns.time.thread_time", lambda: next(spent))
    some = Turns(woken.set, beside_after=0.02)
    some.begin(1, lambda: held(gate))
    gate.set()
    until_woken(woken)
    some.ended()
    gate.clear()
    waits: list[float | None] = []
    monkeypatch.setattr(turns, "wait", lambda _futures, seconds: waits.append(seconds))
    some.begin(1, lambda: held(gate))
    some.begin(2, lambda: 0.0)
    assert waits == [0.02] * waited_for


def test_long_turns_leave_room_for_quick_ones(woken: threading.Event, gate: threading.Event) -> None:
    some = Turns(woken.set, beside_after=0.001)
    for run_id in range(LONG_AT_ONCE):
        assert some.may_begin(run_id, new=True)
        some.begin(run_id, lambda: held(gate))
    assert not some.may_begin(100, new=True)
    assert some.may_begin(100, new=False)


def test_every_thread_has_one_thread_of_torch(woken: threading.Event, gate: threading.Event) -> None:
    """Two would give other bits."""
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        some = Turns(woken.set, beside_after=0.001)
        some.begin(1, lambda: held(gate))
        some.begin(2, lambda: held(gate, torch.get_num_threads()))
        gate.set()
        some.close(30)
        assert some.ended()[2] == 1
    finally:
        torch.set_num_threads(before)


def test_a_hung_turn_is_known_by_its_age(
    woken: threading.Event, gate: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    some = Turns(woken.set, beside_after=0.001)
    now = [1000.0]
    monkeypatch.setattr("parenting.server.work.turns.time.monotonic", lambda: now[0])
    some.begin(1, lambda: held(gate))
    now[0] += turns.HUNG_SECONDS + 1
    some.begin(2, lambda: held(gate))
    assert some.working(turns.HUNG_SECONDS) == {1}


def test_what_a_turn_raises_is_not_swallowed(woken: threading.Event) -> None:
    some = Turns(woken.set, beside_after=30)
    some.begin(1, lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        some.ended()


def test_the_end_waits_for_a_turn_no_longer_than_it_may(
    woken: threading.Event, gate: threading.Event
) -> None:
    some = Turns(woken.set, beside_after=0.001)
    some.begin(1, lambda: held(gate))
    some.close(0.01)
    assert some.working() == {1}
