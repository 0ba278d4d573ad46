"""Verdicts: what agrees, what does not, and what proves nothing."""

from __future__ import annotations

import pytest

from parenting.experiments.reporting.comparison import (
    LOST,
    NEVER,
    NONE_OF_100,
    SILENT,
    Comparison,
    compare_count,
    compare_mean,
    count_verdicts,
    mean_sd,
    seldom_enough,
)


def test_a_standard_deviation_is_over_n_less_one() -> None:
    assert mean_sd([1, 2, 3]) == "2.00 +- 1.00"
    assert mean_sd([4]) == "4.00"
    assert mean_sd([]) == "-"


@pytest.mark.parametrize("paper", [NEVER, NONE_OF_100])
def test_one_counterexample_refutes_never_and_a_few_trials_prove_nothing(paper: str) -> None:
    assert compare_count("pressed", paper, 0, 100).agrees is True
    assert compare_count("pressed", paper, 0, 4).agrees is None
    missed = compare_count("pressed", paper, 1, 50)
    assert (missed.agrees, missed.ours, missed.difference) == (False, "1 of 50", "+2.0 points")


def test_never_is_supported_once_the_interval_ends_at_five_per_cent() -> None:
    """Wilson's interval of 0 of n ends at z^2 / (n + z^2): above 5 % for 72 trials, below it for 73."""
    assert [seldom_enough(0, trials) for trials in (0, 1, 20, 72, 73, 10_000)] == [None] * 4 + [True] * 2
    assert [seldom_enough(1, trials) for trials in (1, 10_000)] == [False] * 2


@pytest.mark.parametrize(("paper", "reference"), [(LOST, "paper"), (SILENT, None)])
def test_a_count_without_a_legible_counterpart_has_no_verdict(paper: str, reference: str | None) -> None:
    found = compare_count("optimal", paper, 0, 100)
    assert (found.agrees, found.difference, found.reference) == (None, "", reference)


def test_a_mean_of_ours_alone_is_compared_with_nothing() -> None:
    found = compare_mean("ticks", [1, 2, 3])
    assert (found.agrees, found.reference, found.paper) == (None, None, SILENT)
    assert found.interval


def test_verdicts_are_counted_apart_by_what_rows_are_compared_with() -> None:
    rows = [
        Comparison("a", "1", "1", agrees=True),
        Comparison("b", "1", "2", agrees=False),
        Comparison("c", "above 5", "2"),
        Comparison("lost", LOST, "2"),
        Comparison("d", "1", "1", agrees=True, reference="fit"),
        Comparison("e", "1", "1", agrees=True, reference="check"),
        Comparison("f", SILENT, "1", reference=None),
    ]
    assert count_verdicts(rows) == {
        "paper": {"yes": 1, "no": 1, "open": 1},
        "fit": {"yes": 1, "no": 0, "open": 0},
        "check": {"yes": 1, "no": 0, "open": 0},
    }
