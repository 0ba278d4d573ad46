"""The processes that `parenting up` keeps running: one that dies is started again."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Protocol

from parenting.server.lifeline import VARIABLE
from parenting.server.signal_event import SignalEvent

FIRST_WAIT, LONGEST_WAIT = 0.5, 30.0
"""Seconds before a dead process is started again: doubled at each death, up to the longest."""
STEADY_SECONDS = 60.0
"""A process that ran for this long starts with the first wait again when it dies."""
STOP_SECONDS = 4.0
"""Seconds that all get to stop by themselves. Killed after that, they lose nothing."""
LOOK_SECONDS = 0.1
REFUSED = 2
"""The exit code of a command that cannot work as it is set up; it has said why."""

Process = subprocess.Popen[bytes]


class RefusedError(Exception):
    """A process cannot work as it is set up, so that a second start would end alike."""


class Child:
    """A process that is started again, after a growing wait, whenever it dies."""

    def __init__(self, name: str, start: Callable[[], Process], tell: Callable[[str], None]) -> None:
        """Start the process.

        Args:
            name: Its name in sentences.
            start: Starts the process.
            tell: Takes a sentence about each of its deaths.
        """
        self.name, self._start, self._tell = name, start, tell
        self.process = start()
        self._started, self._again_at = time.monotonic(), 0.0
        self._deaths, self._waits = 0, False

    def look(self) -> None:
        """Start the process again if it is dead and has waited long enough.

        Raises:
            RefusedError: its first start ended with the exit code of a wrong setting.
        """
        if self._waits:
            if time.monotonic() >= self._again_at:
                self._again()
        elif (code := self.process.poll()) is not None:
            lately = time.monotonic() - self._started < STEADY_SECONDS
            if code == REFUSED and lately and not self._deaths:
                raise RefusedError(f"The {self.name} process cannot work like this, so all was stopped.")
            self._deaths = self._deaths if lately else 0
            self._wait(f"The {self.name} process ended by itself ({how(code)})")

    def _again(self) -> None:
        try:
            self.process, self._started, self._waits = self._start(), time.monotonic(), False
        except OSError as error:  # no memory or no process left
            self._wait(f"The {self.name} process cannot be started ({error.strerror})")

    def _wait(self, why: str) -> None:
        wait = min(LONGEST_WAIT, FIRST_WAIT * 2 ** min(self._deaths, 10))
        self._deaths, self._waits, self._again_at = self._deaths + 1, True, time.monotonic() + wait
        self._tell(f"{why}; it starts again in {wait:g} s.")


class Watched(Protocol):
    """A process, or several, that `watch` keeps running."""

    def look(self) -> None:
        """Start again what is dead."""
        ...


def watch(children: Sequence[Watched], told: SignalEvent) -> None:
    """Keep processes running until the event is set.

    Raises:
        RefusedError: one of them cannot work as it is set up.
    """
    while not told.wait(LOOK_SECONDS):
        for child in children:
            child.look()


@contextmanager
def lifeline() -> Iterator[int]:
    """Yield a descriptor for processes to `follow`: they stop when this process is gone."""
    theirs, ours = os.pipe()
    try:
        yield theirs
    finally:
        os.close(theirs)
        os.close(ours)


@contextmanager
def gate() -> Iterator[tuple[int, Callable[[], None]]]:
    """Yield a descriptor for processes to wait at (`server.lifeline.wait_at`), and what lets them through."""
    theirs, ours = os.pipe()
    left = [ours]

    def open_gate() -> None:
        if left:
            os.close(left.pop())

    try:
        yield theirs, open_gate
    finally:
        os.close(theirs)
        open_gate()


def start(arguments: Sequence[str], followed: int, descriptors: Sequence[int] = ()) -> Process:
    """Start `parenting ...` in a session of its own: Ctrl-C reaches this process alone, which stops it."""
    # With -P, Python does not look for packages in the current folder: a project of the user's may have a
    # package of our name there.
    command = [sys.executable, "-P", "-m", "parenting.commands.main", *arguments]
    return subprocess.Popen(
        command,
        env={**os.environ, VARIABLE: str(followed)},
        pass_fds=[followed, *descriptors],
        stdin=subprocess.DEVNULL,
        start_new_session=True,
    )


def stop(children: Sequence[Child]) -> None:
    """Stop every process in order, and kill those that have not ended `STOP_SECONDS` later."""
    for child in children:
        if child.process.poll() is None:
            child.process.terminate()
    end = time.monotonic() + STOP_SECONDS
    for child in children:
        try:
            child.process.wait(max(0.0, end - time.monotonic()))
        except subprocess.TimeoutExpired:
            child.process.kill()
            child.process.wait()


def how(code: int) -> str:
    """Say how a process ended."""
    return f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
