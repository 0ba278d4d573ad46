"""The queue under any order of what people, worker, operator and clock do (tests/faults/queue_machine.py)."""

from __future__ import annotations

import random
from collections.abc import Iterator
from datetime import datetime, timedelta

import pytest
from hypothesis import HealthCheck, Phase, seed
from hypothesis import settings as hypothesis_settings
from hypothesis.stateful import run_state_machine_as_test

from parenting.server.db import Database
from parenting.server.settings import Settings
from tests.database import migrated
from tests.faults.auditor import Store, audit
from tests.faults.figures import Figures
from tests.faults.ledger import Entries
from tests.faults.queue_machine import Queue
from tests.faults.queue_model import Machines
from tests.lengths import length
from tests.server.conftest import Clock

EXAMPLES = {"sqlite": length(150, 50_000), "postgresql": length(150, 5000)}
STEPS = length(40, 100)
RARE = {"a heard answer changed", "an answer taken back", "a correction heard", "an ended run goes on"}
"""Steps that only follow others, and must have happened."""


class Clocks(Clock):
    """The wall clock may be set; the clock of leases and claims only goes on."""

    def __init__(self) -> None:
        super().__init__()
        self.wrong = timedelta()

    def __call__(self) -> datetime:
        return self.now + self.wrong

    def set_wall_clock(self, seconds: float) -> None:
        self.wrong += timedelta(seconds=seconds)


@pytest.fixture
def clock() -> Clocks:
    return Clocks()


@pytest.fixture
def db(settings: Settings, clock: Clocks) -> Iterator[Database]:
    database = migrated(settings, clock)
    quickened(database)
    yield database
    database.close()


def quickened(db: Database) -> None:
    """Spare the machine two of three words with PostgreSQL's server: nobody else writes while it reads.

    A transaction that reads begins and ends with its only statement.
    """
    if not db.one_writer:
        db._reading = db._reading.execution_options(isolation_level="AUTOCOMMIT")


@pytest.mark.torture
@pytest.mark.timeout(length(1800, 100_000))
def test_queue_does_what_its_model_says(
    store: str, db: Database, clock: Clocks, kept: Store, rng: random.Random, figures: Figures
) -> None:
    class Shared(Queue):
        shared = Machines(db, clock.pass_seconds, clock.set_wall_clock)

    examples = EXAMPLES[store]
    for number in (examples, *(4 * [examples // 5])):  # a rare step may need more examples
        if not Shared.shared.steps or RARE - Shared.shared.steps.keys():
            drawn = seed(rng.randrange(2**32))(Shared)
            run_state_machine_as_test(drawn, settings=_settings(number))
    assert audit(kept, Entries(Shared.shared.told, [])) == []
    for name, number in Shared.shared.steps.items():
        figures.count("steps of the queue's state machine", name, number)
    assert len(Shared.shared.steps) >= 20, Shared.shared.steps
    assert Shared.shared.steps.keys() >= RARE, Shared.shared.steps


def _settings(examples: int) -> hypothesis_settings:
    return hypothesis_settings(
        max_examples=examples,
        stateful_step_count=STEPS,
        deadline=None,
        database=None,
        phases=[Phase.generate],  # a failure is told at once; to shrink it takes minutes
        suppress_health_check=list(HealthCheck),
    )
