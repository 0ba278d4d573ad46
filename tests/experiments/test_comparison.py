"""Intervals by hand, and what counts as agreement."""

from __future__ import annotations

import pytest

from parenting.experiments.reporting.comparison import (
    LOST,
    compare_count,
    difference_interval,
    format_interval,
    mean_interval,
    mean_sd,
    proportion_interval,
)


def test_spread_is_over_n_less_one() -> None:
    assert mean_sd([1, 2, 3]) == "2.00 +- 1.00"
    assert mean_sd([4]) == "4.00"
    assert mean_sd([]) == "-"


def test_interval_of_a_mean_by_hand() -> None:
    """sd 1, n = 3: 1.96 / sqrt(3) = 1.1316."""
    low, high = mean_interval([1, 2, 3]) or (0, 0)
    assert (low, high) == pytest.approx((2 - 1.13158, 2 + 1.13158), abs=1e-4)
    assert mean_interval([1]) is None


def test_interval_of_a_difference_by_hand() -> None:
    """Variances 1 and 4 of three each: 1.96 sqrt(5 / 3) = 2.5303 around 5 - 2."""
    interval = difference_interval([4, 5, 6], [0, 2, 4])
    assert interval == pytest.approx((3 - 2.53030, 3 + 2.53030), abs=1e-4)
    assert format_interval(interval) == "0.47 to 5.53"
    assert difference_interval([1], [1, 2]) is None
    assert format_interval(None) == ""


def test_interval_of_a_share_by_hand() -> None:
    """Wilson, 0 of 100: high = z^2 / (n + z^2) = 3.8415 / 103.8415."""
    assert proportion_interval(0, 100) == pytest.approx((0, 0.036994), abs=1e-5)
    low, high = proportion_interval(50, 100)
    assert (low, high) == pytest.approx((0.40383, 0.59617), abs=1e-4)
    assert proportion_interval(100, 100)[1] == 1.0
    with pytest.raises(ValueError, match="no trials"):
        proportion_interval(0, 0)


def test_a_count_agrees_or_not() -> None:
    assert compare_count("pressed", 0, 0, 100).agrees is True
    missed = compare_count("pressed", 0, 1, 50)
    assert (missed.agrees, missed.ours, missed.difference) == (False, "1 of 50", "+2.0 points")
    assert compare_count("optimal", LOST, 7, 9).agrees is None
