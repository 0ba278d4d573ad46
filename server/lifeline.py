"""A pipe from one process to those that it starts: when it ends, however it ends, they stop too."""

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
