"""The process of a worker: it hears signals in one thread, and raises runs in another."""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
from collections.abc import Callable
from functools import partial

import structlog

from parenting._process import settle
from parenting.envs import registry
from parenting.server.db import connect
from parenting.server.migrate import require_ready
from parenting.server.settings import Settings
from parenting.server.signal_event import SignalEvent
from parenting.server.work.turns import BESIDE_SECONDS
from parenting.server.worker import Worker

log = structlog.get_logger()

SWITCH_SECONDS = 0.001
"""A thread that waits for Python's lock gets it after so long: a tick takes it some hundred times."""
STOP_SECONDS = 3.5
"""A worker that has not ended so long after the signal ends anyway: a store may hold its threads."""


def main(settings: Settings) -> int:
    """Raise the runs of this database until SIGTERM or SIGINT.

    The work is in another thread: this one hears signals, and ends the process in time even while the store
    holds the other.

    Raises:
        SetupError: the database cannot be used as it is.
    """
    settle()
    sys.setswitchinterval(SWITCH_SECONDS)
    for broken in registry.INSTALLED.broken().values():
        log.warning(broken)
    worker = Worker(connect(settings), settings, BESIDE_SECONDS)
    signal.signal(signal.SIGTERM, worker.stop)
    signal.signal(signal.SIGINT, worker.stop)
    worker.patient(partial(require_ready, worker.db))
    if settings.ballast:
        worker.db.keep_ballast()
    gc.freeze()  # loaded modules stay: searching them for garbage takes a tenth of a second
    failed: list[BaseException] = []
    loop = threading.Thread(target=_keep, args=(worker.work, worker.told, failed), name="worker", daemon=True)
    loop.start()
    worker.told.wait()
    loop.join(STOP_SECONDS)
    if failed:
        raise failed[0]
    if loop.is_alive() or worker.working():
        sys.stderr.flush()
        os._exit(0)  # whatever goes on is lost, and done again from the last checkpoint
    worker.db.close()
    return 0


def _keep(work: Callable[[], None], told: SignalEvent, failed: list[BaseException]) -> None:
    """Call a function and keep what it raises for the main thread."""
    try:
        work()
    except BaseException as error:
        failed.append(error)
    finally:
        told.set()
