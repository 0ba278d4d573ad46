"""The store refuses at every n-th statement and commit of a worker that raises a short run.

Each time the record and all state equal those of the undisturbed run: nothing lost, doubled or asked twice.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from parenting.server.db import Database
from parenting.server.settings import Settings
from tests.database import migrated
from tests.faults.figures import Figures
from tests.lengths import length
from tests.server.conftest import Clock
from tests.server.refusing import SAID, Refusal, hold, raised_on

STEP = {"sqlite": length(short=17, long=1), "postgresql": length(short=81, long=3)}
"""One in so many statements, from a drawn one on."""
KINDS = length(short=1, long=len(SAID))
"""Kinds of refusals at each."""


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def db(settings: Settings, clock: Clock) -> Iterator[Database]:
    database = migrated(settings, clock)
    yield database
    database.close()


@pytest.mark.torture
@pytest.mark.timeout(length(1800, 7200))
@pytest.mark.parametrize("when", ["before", "after"])
def test_a_refusal_at_every_statement_changes_nothing(
    when: str,
    db: Database,
    clock: Clock,
    settings: Settings,
    store: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    rng: random.Random,
    figures: Figures,
) -> None:
    """It takes a second for each place; *after* is a commit whose reply is an error."""
    counted = Refusal(1_000_000, when=when)
    first, kept = raised_on(db, clock, settings, monkeypatch, counted)
    hold(db, first, kept, kept)
    for place in range(rng.randrange(1, STEP[store] + 1), counted.passed + 1, STEP[store]):
        for name in rng.sample(list(SAID), KINDS):
            refusal = Refusal(place, name, rng.choice([1, 1, 5]), when)
            run, found = raised_on(db, clock, settings, monkeypatch, refusal)
            print(f"refusal {when} {place}: {name}, {refusal.raised} of {refusal.times} times")
            hold(db, run, found, kept)
            figures.count("worker's statements refused", f"{when}: {name}", refusal.raised)
    assert counted.passed > 20
