"""Pipes from one process to those that it starts: when it ends they stop too, and begin when it lets them."""

from __future__ import annotations

import os
import signal
import threading

VARIABLE = "PARENTING_LIFELINE"


def follow() -> None:
    """Stop this process, as SIGTERM would, when the process that holds the other end is gone.

    Does nothing without one.
    """
    number = os.environ.pop(VARIABLE, None)
    if number is not None:
        threading.Thread(target=_wait, args=(int(number),), daemon=True, name="lifeline").start()


def _wait(descriptor: int) -> None:
    os.read(descriptor, 1)  # nobody ever writes: it ends when the other end is closed
    os.kill(os.getpid(), signal.SIGTERM)


def wait_at(gate: int | None) -> None:
    """Wait until the process that holds the other end of a pipe closes it; None waits for nothing."""
    if gate is not None:
        os.read(gate, 1)  # nobody ever writes
