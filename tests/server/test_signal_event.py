"""An event is set by a signal handler at whatever moment, and everybody who waits goes on."""

import sys
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any

import pytest

from parenting.server.signal_event import SignalEvent

Event = SignalEvent | threading.Event
ACTS: list[Callable[[Event], object]] = [
    lambda event: event.wait(0.001),
    lambda event: event.set(),
]


def interrupted(event: Event, act: Callable[[Event], object]) -> threading.Thread:
    """Use an event in a thread, in which `set` is called before every line of it, as a handler may be."""

    def trace(_frame: FrameType, _what: str, _value: Any) -> Any:
        sys.settrace(None)
        event.set()
        sys.settrace(trace)
        return trace

    def use() -> None:
        sys.settrace(trace)
        act(event)
        sys.settrace(None)

    thread = threading.Thread(target=use, daemon=True)
    thread.start()
    return thread


@pytest.mark.parametrize("act", ACTS)
def test_set_may_interrupt_every_line_of_it(act: Callable[[Event], object]) -> None:
    thread = interrupted(event := SignalEvent(), act)
    thread.join(60)
    assert not thread.is_alive()
    assert event.is_set()


@pytest.mark.parametrize("act", ACTS)
def test_an_event_of_threading_would_wait_for_itself(act: Callable[[Event], object]) -> None:
    """The proof that the test above can fail."""
    thread = interrupted(threading.Event(), act)
    thread.join(0.5)
    assert thread.is_alive()


def test_all_who_wait_go_on() -> None:
    event, gone_on = SignalEvent(), []
    threads = [threading.Thread(target=lambda: gone_on.append(event.wait(60))) for _ in range(5)]
    for thread in threads:
        thread.start()
    event.set()
    event.set()
    for thread in threads:
        thread.join(60)
    assert gone_on == [True] * 5
    assert [event.wait(), event.wait(0), event.wait(-1)] == [True] * 3


def test_a_wait_ends_without_it() -> None:
    event = SignalEvent()
    assert [event.wait(0.001), event.wait(0), event.wait(-1), event.is_set()] == [False] * 4
