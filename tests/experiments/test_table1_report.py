"""The rows of Table 1 by hand: when a cell agrees, the order, and who is born optimal."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from parenting.experiments.reporting.comparison import Comparison
from parenting.experiments.runner.store import Row
from parenting.experiments.table1.report import ALGORITHMS, cells, optimal_initially, order
from parenting.experiments.training.tasks import parent_trials, reinforce_trials

WORLD, LEVEL = "unsafe-exploration", "island"
BORN = 86
"""A trial of seed 0 whose fresh policy is optimal on the island."""


def rows(of: str, deaths: Sequence[int], ticks: int = 9) -> list[Row]:
    return [
        {
            "of": of,
            "trial": trial,
            "finished": True,
            "ticks": ticks,
            "guidance": 0,
            "preference": 50,
            "deaths": died,
        }
        for trial, died in enumerate(deaths)
    ]


def deaths(of: str, values: Sequence[int]) -> Comparison:
    one = next(each for each in ALGORITHMS if each.name == of)
    return cells(one, rows(of, values))[0]


@pytest.mark.parametrize(
    ("of", "values", "agrees"),
    [
        ("traditional", [1600, 1600], True),
        ("traditional", [3001, 3001], False),
        ("direct", [33, 61], True),
        ("direct", [32, 32], False),
        ("lax", [1, 1], None),
    ],
)
def test_a_mean_agrees_within_the_papers_deviation(
    of: str, values: Sequence[int], agrees: bool | None
) -> None:
    assert deaths(of, values).agrees is agrees


@pytest.mark.parametrize(
    ("values", "agrees"),
    [
        ([0] * 9 + [1], True),
        ([0, 1, 0, 5], None),
        ([2, 3, 2, 3], False),
        ([1, 1], None),
        ([0], None),
        ([0] * 100, True),
        ([2, 2], None),
    ],
)
def test_seldom_is_judged_by_the_whole_interval(values: Sequence[int], agrees: bool | None) -> None:
    found = deaths("conservative", values)
    assert found.agrees is agrees
    seldom = sum(value <= 1 for value in values)
    assert found.note == f"{seldom} of {len(values)} trials have at most one death"


def test_the_order_by_hand() -> None:
    """A gap of 2 sd in few trials does not prove an order, and the opposite order is a miss."""
    some = [
        *rows("traditional", [100, 110, 120]),
        *rows("direct", [10, 11, 12]),
        *rows("lax", [9, 11, 13]),
        *rows("conservative", [30, 31, 32]),
    ]
    found = order(some)
    assert [one.agrees for one in found] == [True, None, False]
    assert [one.ours for one in found] == ["99.00", "0.00", "-20.00"]
    assert [bool(one.note) for one in found] == [False, True, True]
    assert order([])[0].agrees is None


def test_who_is_born_optimal_costs_nothing_in_any_algorithm() -> None:
    """So that all four means are of the same trials, by the same rule."""
    span = BORN, BORN + 1
    found = reinforce_trials("traditional", WORLD, LEVEL, {}, 9, span, 0)
    for preset in ("direct", "lax", "conservative"):
        found += parent_trials(preset, WORLD, LEVEL, preset, {}, ("optimal", 0), 9, span, 0)
    assert [(row["deaths"], row["guidance"], row["preference"]) for row in found] == [(0, 0, 0)] * 4
    assert all(row["finished"] and row["ticks"] <= 1 for row in found)
    assert optimal_initially([*found, *rows("lax", [0, 0, 0])]).ours == "1 of 4"
