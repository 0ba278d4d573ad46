"""The store refuses at the n-th statement of a worker: afterwards nothing is lost, doubled or asked twice.

tests/faults has the long form, for every n.
"""

from __future__ import annotations

import random

import pytest

from parenting.server.db import Database
from parenting.server.settings import Settings
from tests.server.conftest import Clock
from tests.server.refusing import SAID, Record, Refusal, hold, raised_on

SAMPLES = 6


@pytest.fixture
def undisturbed(
    db: Database, clock: Clock, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> tuple[Record, int, int]:
    """The record of the undisturbed run, its statements and its commits."""
    statements, commits = Refusal(1_000_000), Refusal(1_000_000, when="after")
    run, kept = raised_on(db, clock, settings, monkeypatch, statements)
    hold(db, run, kept, kept)
    assert raised_on(db, clock, settings, monkeypatch, commits)[1] == kept
    return kept, statements.passed, commits.passed


def test_a_refusal_at_any_statement_changes_nothing(
    undisturbed: tuple[Record, int, int],
    db: Database,
    clock: Clock,
    settings: Settings,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    kept, statements, commits = undisturbed
    drawn = random.Random(5)
    for number in range(SAMPLES):
        when = "after" if number % 3 == 2 else "before"
        place = drawn.randrange(1, commits if when == "after" else statements)
        refusal = Refusal(place, drawn.choice(list(SAID)), drawn.choice([1, 1, 4]), when)
        run, found = raised_on(db, clock, settings, monkeypatch, refusal)
        assert refusal.raised, vars(refusal)
        hold(db, run, found, kept)
