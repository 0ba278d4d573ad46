"""`parenting up` starts a dead process again, after a wait that grows, and stops where that is of no use."""

from __future__ import annotations

import subprocess
import sys

import pytest

from parenting.commands import children
from parenting.commands.children import Child, RefusedError, stop, watch
from parenting.server.signal_event import SignalEvent


class Clock:
    """A clock that stands still until it is moved."""

    now = 1000.0

    def __call__(self) -> float:
        return self.now


class Fallen:
    """A process that has ended already, with this exit code."""

    def __init__(self, code: int) -> None:
        self.code = code

    def poll(self) -> int:
        return self.code


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("parenting.commands.children.time.monotonic", clock)
    return clock


def mortal(codes: list[int], said: list[str]) -> Child:
    """A child whose processes end at once, one after another with these exit codes."""
    left = iter(codes)
    return Child("worker", lambda: Fallen(next(left)), said.append)  # type: ignore[arg-type, return-value]


def test_the_wait_grows_with_each_death_up_to_half_a_minute(clock: Clock) -> None:
    said: list[str] = []
    child = mortal([1] + [-9] * 9, said)
    for _ in range(9):
        child.look()
        clock.now += children.LONGEST_WAIT
        child.look()
    waits = [float(sentence.rpartition(" in ")[2].split()[0]) for sentence in said]
    assert waits == [0.5, 1, 2, 4, 8, 16, 30, 30, 30]
    assert said[0] == "The worker process ended by itself (exit code 1); it starts again in 0.5 s."
    assert "(killed by SIGKILL)" in said[1]


def test_it_waits_before_it_starts_again_and_says_each_death_once(clock: Clock) -> None:
    said: list[str] = []
    child = mortal([0, 0], said)
    first = child.process
    for _ in range(5):
        child.look()
    assert child.process is first
    assert len(said) == 1
    clock.now += children.FIRST_WAIT
    child.look()
    assert child.process is not first


def test_after_a_steady_life_the_first_wait_is_short_again(clock: Clock) -> None:
    said: list[str] = []
    child = mortal([1] * 5, said)
    for alive in (0, 0, 0, children.STEADY_SECONDS):
        clock.now += alive
        child.look()
        clock.now += children.LONGEST_WAIT
        child.look()
    assert said[2].endswith("in 2 s.")
    assert said[3].endswith("in 0.5 s.")


def test_a_wrong_setting_at_the_first_start_ends_it_all(clock: Clock) -> None:
    with pytest.raises(RefusedError, match="The worker process cannot work like this"):
        watch([mortal([children.REFUSED], [])], SignalEvent())


def test_the_same_exit_code_later_does_not(clock: Clock) -> None:
    said: list[str] = []
    child = mortal([1, children.REFUSED, 1], said)
    for _ in range(2):
        child.look()
        clock.now += children.LONGEST_WAIT
        child.look()
    assert "(exit code 2)" in said[1]
    late = mortal([children.REFUSED, 1], said)
    clock.now += children.STEADY_SECONDS
    late.look()
    assert len(said) == 3


def test_no_memory_for_a_process_counts_as_a_death(clock: Clock) -> None:
    said: list[str] = []
    started: list[Fallen] = []

    def start() -> Fallen:
        if started:
            raise OSError(11, "Resource temporarily unavailable")
        started.append(Fallen(1))
        return started[0]

    child = Child("web", start, said.append)  # type: ignore[arg-type]
    for _ in range(3):
        child.look()
        clock.now += children.LONGEST_WAIT
    assert said[1:] == [
        f"The web process cannot be started (Resource temporarily unavailable); it starts again in {wait} s."
        for wait in (1, 2)
    ]


def test_a_child_that_does_not_stop_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(children, "STOP_SECONDS", 0.1)
    deaf = "import signal as s, time; s.signal(s.SIGTERM, s.SIG_IGN); print(flush=True); time.sleep(60)"
    child = Child(
        "web", lambda: subprocess.Popen([sys.executable, "-c", deaf], stdout=subprocess.PIPE), lambda _: None
    )
    assert child.process.stdout is not None
    child.process.stdout.readline()  # it ignores the signal from here on
    stop([child])
    child.process.stdout.close()
    assert child.process.returncode == -9
