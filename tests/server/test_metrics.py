"""Metrics are stored by tick, and read in the order of the ticks."""

import math

import pytest

from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.metrics import write_metrics
from parenting.server.reads.metrics import list_metrics
from parenting.server.runs import Claim


def test_metrics_after_a_tick(db: Database, mine: Claim) -> None:
    write_metrics(db, mine, {2: {"loss": 0.5}, 1: {"loss": 0.75, "deaths": 1}})
    assert [(row.tick, row.values) for row in list_metrics(db, mine.run_id)] == [
        (1, {"loss": 0.75, "deaths": 1}),
        (2, {"loss": 0.5}),
    ]
    assert [row.tick for row in list_metrics(db, mine.run_id, after=1)] == [2]
    assert [row.tick for row in list_metrics(db, mine.run_id, limit=1)] == [1]


def test_tick_lived_again_replaces_its_metrics(db: Database, mine: Claim) -> None:
    write_metrics(db, mine, {1: {"loss": 0.5}, 2: {"loss": 0.25}})
    write_metrics(db, mine, {2: {"loss": 0.125}})
    assert [row.values["loss"] for row in list_metrics(db, mine.run_id)] == [0.5, 0.125]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_stored_as_null(db: Database, mine: Claim, value: float) -> None:
    write_metrics(db, mine, {1: {"loss": value}})
    assert list_metrics(db, mine.run_id)[0].values == {"loss": None}


def test_metrics_of_an_unknown_run(db: Database) -> None:
    with pytest.raises(NotFound):
        list_metrics(db, 3)
