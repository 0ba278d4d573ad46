"""Signs of life come from a thread of their own, and end with a loop that hangs."""

from __future__ import annotations

import threading
from collections.abc import Callable

import pytest

from parenting.server.errors import BusyError
from parenting.server.work.patience import Patience
from parenting.server.work.signs import Signs


class Count:
    """The signs that were given; each hundredth second one is due."""

    def __init__(self, error: Exception | None = None) -> None:
        self.error, self.number, self.enough = error, 0, threading.Event()

    def __call__(self) -> None:
        self.number += 1
        if self.number >= 3:
            self.enough.set()
        if self.error is not None:
            raise self.error


@pytest.fixture
def make() -> Callable[..., Signs]:
    return lambda give, hung=60.0: Signs(give, 0.01, hung, Patience())


def test_a_loop_that_is_at_work_for_long_has_its_signs_given(make: Callable[..., Signs]) -> None:
    count = Count()
    signs = make(count)
    signs.start()
    assert count.enough.wait(30), "the loop has not come round once"
    signs.close()
    given = count.number
    assert not threading.Event().wait(0.05)
    assert count.number == given, "after the end there is none"


def test_a_loop_that_hangs_has_none(make: Callable[..., Signs]) -> None:
    count = Count()
    signs = make(count, hung=0.0)
    signs.start()
    assert not count.enough.wait(0.1)
    signs.close()
    assert count.number == 0


def test_without_a_thread_the_loop_gives_them_when_due(make: Callable[..., Signs]) -> None:
    count = Count()
    signs = make(count)
    signs.every = 60.0
    signs.if_due()
    signs.if_due()
    assert count.number == 1
    signs.if_due(at_once=True)
    assert count.number == 2


def test_while_the_store_refuses_the_loop_alone_asks_again(make: Callable[..., Signs]) -> None:
    count = Count(BusyError())
    signs = make(count)
    signs.start()
    assert not count.enough.wait(0.2)
    signs.close()
    assert count.number == 1
    assert signs._patience.waits
