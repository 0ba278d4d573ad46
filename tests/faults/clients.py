"""Clients of the database itself as processes: each asks, leases and answers until it kills itself."""

from __future__ import annotations

import os
import random
import signal
from pathlib import Path

from parenting.server.db import Database, connect
from parenting.server.errors import Conflict
from parenting.server.queue.answers import answer
from parenting.server.queue.leases import lease, release
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.settings import Settings
from tests.faults import tap
from tests.faults.ledger import Ledger
from tests.faults.points import Mark, place_of
from tests.faults.tap import Moment
from tests.server.conftest import CLIPS

CHOICES = ("left", "right", "either", "neither")
TICKS = 10_000
"""Each client has so many ticks of its own."""


class Nth:
    """Kills this process at the n-th moment that passes: whichever that is, or of those at one place."""

    def __init__(self, number: int, place: str | None = None) -> None:
        self.left, self.place = number, place

    def __call__(self, moment: Moment) -> None:
        if self.place not in (None, place_of(moment)):
            return
        self.left -= 1
        if not self.left:
            os.kill(os.getpid(), signal.SIGKILL)


def live(
    data: str,
    url: str | None,
    mine: Claim,
    number: int,
    seed: float,
    moments: int,
    place: str | None = None,
) -> None:
    """Ask, lease, answer and let go until killed at that moment; the ledger says what was stored."""
    db = connect(Settings(data=Path(data), database_url=url))
    ledger, rng, name = Ledger(Path(data) / f"ledger-{number}"), random.Random(seed), f"client-{number}"
    tap.listen(Mark(Path(data) / f"{name}.mark", ()))
    tap.listen(Nth(moments, place))
    for tick in range(number * TICKS, (number + 1) * TICKS):
        post_query(db, mine, tick, "guidance", 1, CLIPS)
        held = lease(db, mine.run_id, name, seconds=1.0)
        if held is None:
            continue
        if rng.random() < 0.2:
            release(db, held.id, name)
            continue
        _answer(db, ledger, held.id, name, rng.choice(CHOICES))


def _answer(db: Database, ledger: Ledger, query: int, name: str, choice: str) -> None:
    try:
        stored = answer(db, query, choice, name, "human")
    except Conflict:
        return  # its lease was over, and somebody else was faster
    receipt = {"query": stored.query, "run": stored.run, "number": stored.number, "choice": stored.choice}
    ledger.told(receipt, name)
